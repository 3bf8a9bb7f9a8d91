// A closed triangle mesh as a bounding volume tree, in double: nearest triangles of a chosen kind, and which points are
// inside. For meshes of some thousand triangles; full_surface.h is for the large ones.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

class TriangleTree {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Nearest {
    double distance_m;
    std::uint32_t triangle;  ///< kNone if there is none within
  };

  /// The mesh must outlive this. Queries are safe from several threads at once.
  explicit TriangleTree(const geometry::TriangleMesh& mesh);

  /// The nearest of the triangles that counts(triangle) is true of, strictly within within_m; else {within_m, kNone}.
  template <typename Counts>
  [[nodiscard]] Nearest nearest(const glm::dvec3& p_O, double within_m, const Counts& counts) const;

  /// Some of a tree's triangles: marked in it, so that not all of them are looked at.
  class Some {
   public:
    /// None. The tree must outlive this.
    explicit Some(const TriangleTree&);
    /// These, in place of those before.
    void mark(std::span<const std::uint32_t> triangles);
    /// Of those that are equally near the first listed; {infinity, kNone} of none.
    [[nodiscard]] Nearest nearest(const glm::dvec3& p_O) const;

   private:
    const TriangleTree& tree_;
    std::uint32_t mark_ = 0;                      // counts the lists
    std::vector<std::uint32_t> node_, triangle_;  // the list that last marked them
    std::vector<std::uint32_t> place_;            // of a triangle in that list
  };

  /// The surface winds round p_O: a ray leaves it more often than it enters. Where a mesh overlaps itself, all is
  /// inside.
  [[nodiscard]] bool is_inside(const glm::dvec3& p_O) const;

  [[nodiscard]] const glm::dvec3& normal(std::uint32_t triangle) const { return normals_[triangle]; }  ///< or zero

 private:
  struct Node {
    geometry::Box box;
    std::uint32_t parent;  ///< the root's own is itself
    std::uint32_t first,
        count;  ///< leaf: into order_; else count is 0 and `first` is the left child, right after it the other
  };
  static constexpr std::size_t kMostDepth = 64;

  [[nodiscard]] double distance_m(const glm::dvec3& p_O, std::uint32_t triangle) const;
  void split(std::uint32_t node, std::uint32_t parent, std::uint32_t first, std::uint32_t count);
  [[nodiscard]] static double square_distance(const geometry::Box& box, const glm::dvec3& p) {
    double square = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double off = std::max({box.low[axis] - p[axis], p[axis] - box.high[axis], 0.0});
      square += off * off;
    }
    return square;
  }

  const geometry::TriangleMesh& mesh_;
  std::vector<glm::dvec3> normals_, middles_;  ///< of each triangle
  std::vector<std::uint32_t> order_, leaf_;    ///< triangles, leaf by leaf; of each the node
  std::vector<Node> nodes_;
};

template <typename Counts>
TriangleTree::Nearest TriangleTree::nearest(const glm::dvec3& p_O, double within_m, const Counts& counts) const {
  Nearest best{within_m, kNone};
  struct Later {
    double square;
    std::uint32_t node;
  };
  std::array<Later, kMostDepth> stack;
  std::size_t waiting = 0;
  if (!nodes_.empty()) stack[waiting++] = {square_distance(nodes_[0].box, p_O), 0};
  while (waiting > 0) {
    const Later next = stack[--waiting];
    if (!(next.square < best.distance_m * best.distance_m)) continue;
    const Node& node = nodes_[next.node];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (!counts(order_[i])) continue;
        const double distance = distance_m(p_O, order_[i]);
        if (distance < best.distance_m) best = {distance, order_[i]};
      }
      continue;
    }
    Later near{square_distance(nodes_[node.first].box, p_O), node.first};
    Later far{square_distance(nodes_[node.first + 1].box, p_O), node.first + 1};
    if (far.square < near.square) std::swap(near, far);
    stack[waiting++] = far;
    stack[waiting++] = near;
  }
  return best;
}

}  // namespace farfeel::slave_sim
