// depth and across change by no more than the way from q to another point q', so where q is allowed, q' is too as long
// as
//   2 |q' - q| <= across + 2 tolerance - depth,
// and it stays inside the solid, or above a part that faces the way by the tolerance at most, as long as
//   |q' - q| <= distance to the surface + tolerance.
// So a face is halved along its longest side until such balls about middles cover it, or its parts are small enough.
// (That `which` is another for q' is left to the next middle.)
#include "slave_sim/bake/own_side.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace farfeel::slave_sim {
namespace {

constexpr double kFacesTheWay = 0.5;  // cos 60 degrees
constexpr double kAnywhere = std::numeric_limits<double>::infinity();

using Corners = std::array<glm::dvec3, 3>;

glm::dvec3 middle(const Corners& c) {
  return (c[0] + c[1] + c[2]) / 3.0;
}

double radius_m(const Corners& c) {
  const glm::dvec3 m = middle(c);
  return std::max({glm::length(c[0] - m), glm::length(c[1] - m), glm::length(c[2] - m)});
}

/// The two halves, divided at the longest side.
std::array<Corners, 2> halves(const Corners& c) {
  std::size_t longest = 0;
  double most = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = glm::length(c[(k + 1) % 3] - c[k]);
    if (side > most) most = side, longest = k;
  }
  const glm::dvec3 &a = c[longest], &b = c[(longest + 1) % 3], &tip = c[(longest + 2) % 3], mid = 0.5 * (a + b);
  return {Corners{a, mid, tip}, Corners{mid, b, tip}};
}

}  // namespace

OwnSide::OwnSide(const geometry::TriangleMesh& mesh, double tolerance_m)
    : mesh_(mesh), tree_(mesh), own_(tree_), tolerance_m_(tolerance_m) {}

double OwnSide::own_m(const glm::dvec3& q, glm::dvec3& way) const {
  const TriangleTree::Nearest own = own_.nearest(q);
  way = tree_.normal(own.triangle);
  return own.distance_m;
}

double OwnSide::depth_m(const glm::dvec3& q, const glm::dvec3& way, double within_m) const {
  const auto faces_the_way = [&](std::uint32_t t) { return glm::dot(tree_.normal(t), way) >= kFacesTheWay; };
  return tree_.nearest(q, within_m, faces_the_way).distance_m;
}

double OwnSide::across_m(const glm::dvec3& q, const glm::dvec3& way, double within_m) const {
  const auto faces_away = [&](std::uint32_t t) {  // triangles without area face nowhere
    return glm::dot(tree_.normal(t), way) < kFacesTheWay && tree_.normal(t) != glm::dvec3(0);
  };
  return tree_.nearest(q, within_m, faces_away).distance_m;
}

OwnSide::Judgement OwnSide::judged(const glm::dvec3& q, double reach_m) const {
  glm::dvec3 way;
  const double own = own_m(q, way);
  if (own <= tolerance_m_) return {true, tolerance_m_ - own};
  const double depth = depth_m(q, way, own);
  if (depth <= tolerance_m_) return {true, tolerance_m_ - depth};
  const double across = across_m(q, way, depth + 2 * reach_m);
  if (depth - across > 2 * tolerance_m_ || !tree_.is_inside(q)) return {false, 0};
  return {true, std::min(0.5 * (across - depth), depth) + tolerance_m_};
}

bool OwnSide::allows(const geometry::Triangle& face, Patch patch, const Fineness& fineness) {
  own_.mark(patch);
  const auto& at = mesh_.positions_O;
  std::vector<Corners> left{{at[face[0]], at[face[1]], at[face[2]]}};
  const double least_m = std::max(fineness.least_m, fineness.share * radius_m(left[0]));
  while (!left.empty()) {
    const Corners part = left.back();
    left.pop_back();
    const double reach_m = radius_m(part);
    const Judgement judgement = judged(middle(part), reach_m);
    if (!judgement.is_allowed) return false;
    if (reach_m <= least_m || judgement.safe_m >= reach_m) continue;
    for (const Corners& half : halves(part)) left.push_back(half);
  }
  return true;
}

Breach OwnSide::breach(const glm::dvec3& q, Patch patch) {
  own_.mark(patch);
  glm::dvec3 way;
  const double own = own_m(q, way), depth = depth_m(q, way, own);
  if (!(depth > 0)) return {};
  const double across = across_m(q, way, kAnywhere);
  if (tree_.is_inside(q)) return {0, std::max(0.0, 0.5 * (depth - across))};
  // Beyond the surface on the other side the way across counts as less than nothing.
  return {std::min(depth, across), across < depth ? 0.5 * (depth + across) : 0};
}

}  // namespace farfeel::slave_sim
