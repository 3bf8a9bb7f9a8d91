// Where a picture is taken from.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::master_station {

/// A pinhole camera; W's z axis is up in its pictures.
struct Camera {
  glm::dvec3 eye_W{0.3, -0.3, 0.3}, target_W{0};  ///< [m], never one above the other
  double field_of_view_rad = 0.6;                 ///< vertical
};

/// Sees all of a box, from in front and above, at the azimuth whose silhouette fills the picture best.
[[nodiscard]] Camera camera_for(const geometry::Box& everything_W, double width_per_height);

/// Looks at a few points from the side the other camera looks from, `extent_m` high at their distance.
[[nodiscard]] Camera closer(const Camera&, std::span<const glm::dvec3> points_W, double extent_m);

}  // namespace farfeel::master_station
