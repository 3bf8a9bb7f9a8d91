// Indexed triangles in an object's own frame O.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace farfeel::geometry {

using Triangle = std::array<std::uint32_t, 3>;  ///< vertex indices, counter-clockwise seen from outside

struct TriangleMesh {
  std::vector<glm::dvec3> positions_O;  ///< [m]
  std::vector<Triangle> triangles;      ///< every index < positions_O.size()
};

struct Box {
  glm::dvec3 low, high;  ///< [m], low <= high componentwise; a default Box is empty (low = +inf, high = -inf)
  Box();
  void include(const glm::dvec3& p);
  [[nodiscard]] bool is_empty() const;
  [[nodiscard]] glm::dvec3 size() const;    ///< precondition: not empty
  [[nodiscard]] glm::dvec3 centre() const;  ///< precondition: not empty
};

/// The nearest point whose coordinates are exactly representable in float.
[[nodiscard]] glm::dvec3 rounded_to_float(const glm::dvec3&);
[[nodiscard]] Box bounding_box(const TriangleMesh&);
/// Unit outward normal of one triangle; the zero vector if it has no area.
[[nodiscard]] glm::dvec3 unit_normal(const TriangleMesh&, const Triangle&);
/// Signed volume by the divergence theorem, positive when triangles face outwards [m^3]; meaningful for closed meshes.
[[nodiscard]] double signed_volume_m3(const TriangleMesh&);
/// Every edge is shared by exactly two triangles that run along it in opposite directions.
[[nodiscard]] bool is_closed_and_oriented(const TriangleMesh&);

}  // namespace farfeel::geometry
