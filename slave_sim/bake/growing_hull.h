// The convex hull of a few vertices of a mesh, one vertex after the other.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Vertices count as moved by some 1e-7 of the mesh's size, each by its own: so no four of them lie in a plane, and
/// what is flat has a hull, too. For looking at the faces, not for contacts.
class GrowingHull {
 public:
  explicit GrowingHull(const geometry::TriangleMesh& mesh);  ///< the mesh must outlive this

  /// Both sides of a triangle.
  void start(const geometry::Triangle&);
  /// The faces that `vertex` would add; none if it lies inside, or is in the hull already. Until the next call.
  [[nodiscard]] const std::vector<geometry::Triangle>& faces_with(std::uint32_t vertex);
  void take(std::uint32_t vertex);
  /// Their corners counter-clockwise seen from outside.
  [[nodiscard]] const std::vector<geometry::Triangle>& faces() const { return faces_; }

 private:
  [[nodiscard]] bool sees(std::uint32_t vertex, const geometry::Triangle& face) const;

  std::vector<glm::dvec3> moved_O_;
  std::vector<geometry::Triangle> faces_, added_;
  std::vector<bool> is_seen_;                                    ///< per face, from the vertex asked of
  std::vector<std::pair<std::uint32_t, std::uint32_t>> border_;  ///< scratch: edges of the faces that are seen
};

}  // namespace farfeel::slave_sim
