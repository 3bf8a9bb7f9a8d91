#include "slave_sim/bake/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "slave_sim/bake/nearest_on_triangle.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Box;
using geometry::Triangle;

constexpr std::uint32_t kLeaf = 4;  // triangles

/// A direction that no mesh is drawn along, so that rays meet no edges and no faces edge-on.
const glm::dvec3 kRay = glm::normalize(glm::dvec3(0.5377, 0.8314, 0.1397));

bool is_met(const Box& box, const glm::dvec3& p) {
  double from = 0, to = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    from = std::max(from, (box.low[axis] - p[axis]) / kRay[axis]);
    to = std::min(to, (box.high[axis] - p[axis]) / kRay[axis]);
  }
  return from <= to;
}

}  // namespace

TriangleTree::TriangleTree(const geometry::TriangleMesh& mesh)
    : mesh_(mesh), order_(mesh.triangles.size()), leaf_(mesh.triangles.size()) {
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.positions_O[t[0]], &b = mesh.positions_O[t[1]], &c = mesh.positions_O[t[2]];
    middles_.push_back((a + b + c) / 3.0);
    normals_.push_back(geometry::unit_normal(mesh, t));
  }
  std::iota(order_.begin(), order_.end(), 0);
  if (order_.empty()) return;
  nodes_.reserve(mesh.triangles.size());
  nodes_.emplace_back();
  split(0, 0, 0, static_cast<std::uint32_t>(order_.size()));
}

void TriangleTree::split(std::uint32_t node, std::uint32_t parent, std::uint32_t first, std::uint32_t count) {
  Box box, middles;
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const std::uint32_t v : mesh_.triangles[order_[i]]) box.include(mesh_.positions_O[v]);
    middles.include(middles_[order_[i]]);
  }
  if (count <= kLeaf) {
    nodes_[node] = {box, parent, first, count};
    for (std::uint32_t i = first; i < first + count; ++i) leaf_[order_[i]] = node;
    return;
  }
  const glm::dvec3 size = middles.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count,
                   [&](std::uint32_t a, std::uint32_t b) { return middles_[a][axis] < middles_[b][axis]; });
  const auto children = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node] = {box, parent, children, 0};
  nodes_.emplace_back();
  nodes_.emplace_back();
  split(children, node, first, half);
  split(children + 1, node, first + half, count - half);
}

double TriangleTree::distance_m(const glm::dvec3& p_O, std::uint32_t triangle) const {
  const Triangle& t = mesh_.triangles[triangle];
  const auto& at = mesh_.positions_O;
  return glm::length(nearest_on_triangle(p_O, at[t[0]], at[t[1]], at[t[2]]) - p_O);
}

TriangleTree::Some::Some(const TriangleTree& tree)
    : tree_(tree), node_(tree.nodes_.size()), triangle_(tree.order_.size()), place_(tree.order_.size()) {}

void TriangleTree::Some::mark(std::span<const std::uint32_t> triangles) {
  ++mark_;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const std::uint32_t t = triangles[i];
    triangle_[t] = mark_, place_[t] = i;
    for (std::uint32_t node = tree_.leaf_[t]; node_[node] != mark_; node = tree_.nodes_[node].parent)
      node_[node] = mark_;
  }
}

TriangleTree::Nearest TriangleTree::Some::nearest(const glm::dvec3& p_O) const {
  Nearest best{std::numeric_limits<double>::infinity(), kNone};
  // Rounding may not leave out a node with one that is as near.
  constexpr double kRounding = 1 + 1e-12, kNothing_m = 1e-15;
  struct Later {
    double square;
    std::uint32_t node;
  };
  std::array<Later, kMostDepth> stack;
  std::size_t waiting = 0;
  const auto wait = [&](const Later& later) {
    if (node_[later.node] == mark_) stack[waiting++] = later;
  };
  const auto later = [&](std::uint32_t node) { return Later{square_distance(tree_.nodes_[node].box, p_O), node}; };
  if (mark_ > 0 && !tree_.nodes_.empty()) wait(later(0));
  while (waiting > 0) {
    const Later next = stack[--waiting];
    const double within_m = kRounding * best.distance_m + kNothing_m;
    if (next.square > within_m * within_m) continue;
    const Node& node = tree_.nodes_[next.node];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const std::uint32_t t = tree_.order_[i];
      if (triangle_[t] != mark_) continue;
      const double distance = tree_.distance_m(p_O, t);
      if (distance < best.distance_m || (distance == best.distance_m && place_[t] < place_[best.triangle]))
        best = {distance, t};
    }
    if (node.count > 0) continue;
    Later near = later(node.first), far = later(node.first + 1);
    if (far.square < near.square) std::swap(near, far);
    wait(far);
    wait(near);
  }
  return best;
}

bool TriangleTree::is_inside(const glm::dvec3& p_O) const {
  int left = 0;
  std::array<std::uint32_t, kMostDepth> stack;
  std::size_t waiting = 0;
  if (!nodes_.empty()) stack[waiting++] = 0;
  while (waiting > 0) {
    const Node& node = nodes_[stack[--waiting]];
    if (!is_met(node.box, p_O)) continue;
    if (node.count == 0) {
      stack[waiting++] = node.first;
      stack[waiting++] = node.first + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = mesh_.triangles[order_[i]];
      // The ray passes each side p -> q on the same hand; computed from the smaller index on, neighbours agree exactly.
      const auto hand = [&](std::uint32_t from, std::uint32_t to) {
        const double sign = from < to ? 1 : -1;
        const glm::dvec3 a = mesh_.positions_O[std::min(from, to)] - p_O;
        const glm::dvec3 b = mesh_.positions_O[std::max(from, to)] - p_O;
        return sign * glm::dot(glm::cross(a, b), kRay);
      };
      const double u = hand(t[0], t[1]), v = hand(t[1], t[2]), w = hand(t[2], t[0]);
      const bool leaves = u >= 0 && v >= 0 && w >= 0, enters = u < 0 && v < 0 && w < 0;
      if (leaves == enters) continue;
      const glm::dvec3& n = normals_[order_[i]];
      const double along = glm::dot(n, kRay), ahead = glm::dot(n, mesh_.positions_O[t[0]] - p_O);
      if (along != 0 && ahead / along > 0) left += leaves ? 1 : -1;
    }
  }
  return left > 0;
}

}  // namespace farfeel::slave_sim
