// What is drawn: triangles with a normal at every corner, in world axes about a chosen origin.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::master_station {

struct Corner {
  glm::vec3 position;  ///< p - origin, in W [m]
  glm::vec3 normal_W;
  glm::u8vec4 tint_sRGB{255};  ///< times the solid's colour
};
using Solid = std::vector<Corner>;  ///< three corners a triangle

/// A mesh placed in the world. A corner's normal is the mean, by area, of the faces around its vertex that turn away by
/// less than 55 degrees from its own: ridges look round and edges sharp. Tints: one a vertex, or none.
[[nodiscard]] Solid solid_of(const geometry::TriangleMesh& mesh_O, const spatial::Pose& X_WO,
                             const glm::dvec3& origin_W, std::span<const std::array<std::uint8_t, 3>> tints_sRGB = {});

/// Appends an arrow from foot to tip, `radius_m` thick, with a head that never is longer than the arrow.
void append_arrow(Solid&, const glm::dvec3& foot, const glm::dvec3& tip, double radius_m);
void append_ball(Solid&, const glm::dvec3& centre, double radius_m);

}  // namespace farfeel::master_station
