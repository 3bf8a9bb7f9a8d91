// Planar charts: how a coarse mesh is laid out on the displacement texture.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {

/// A connected group of triangles of one piece whose normals agree, and the rectangle it is baked on.
struct ChartPlan {
  std::vector<std::uint32_t> triangles;  ///< of the coarse mesh
  spatial::Pose X_OH = {};               ///< z: the group's mean normal; origin: the rectangle's corner
  std::uint32_t columns = 0, rows = 0;
};

struct ChartLayout {
  std::vector<ChartPlan> charts;
  std::vector<std::uint32_t> triangle_chart;  ///< per coarse triangle
  double texel_m = 0;                         ///< one size for all charts
};

/// 29 degrees: a texel stretches by at most 1 / cos, and ridges of 45 degrees are not yet grazed by rays.
inline constexpr double kChartCone_rad = 0.50;

/// Groups are grown from the largest triangles; texel_m is the least for which all rectangles together have no more
/// than texture * texture texels.
[[nodiscard]] ChartLayout chart_layout(const geometry::TriangleMesh&, const std::vector<std::uint32_t>& triangle_piece,
                                       std::uint32_t texture);

}  // namespace farfeel::slave_sim
