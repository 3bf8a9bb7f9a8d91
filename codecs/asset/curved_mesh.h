// A surface that bends through a mesh's vertices: over each triangle a cubic patch whose corners stand across the
// vertices' normals (PN triangles: Vlachos, Peters, Boyd & Mitchell 2001). Where two triangles meet at more than 40
// degrees their edge stays sharp, and straight.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

class CurvedMesh {
 public:
  /// Precondition: indices are in range.
  explicit CurvedMesh(const geometry::TriangleMesh&);

  [[nodiscard]] std::size_t size() const { return patches_.size(); }
  /// Weights of the triangle's three corners, which add up to 1.
  [[nodiscard]] glm::dvec3 point(std::size_t triangle, const glm::dvec3& weights) const;
  /// The vertices' normals, mixed; unit, or zero.
  [[nodiscard]] glm::dvec3 normal(std::size_t triangle, const glm::dvec3& weights) const;
  /// No point of the patch is farther from the corners' middle.
  [[nodiscard]] double radius_m(std::size_t triangle) const;
  [[nodiscard]] glm::dvec3 middle(std::size_t triangle) const;

 private:
  struct Patch {
    std::array<glm::dvec3, 3> corner, normal;
    std::array<std::array<glm::dvec3, 2>, 3> side;  ///< of edge k, from corner k to k + 1: near k, near k + 1
    glm::dvec3 centre;
  };
  std::vector<Patch> patches_;
};

}  // namespace farfeel::codecs
