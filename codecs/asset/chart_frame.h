// Where the chart of a group of triangles lies: its plane and its rectangle follow from them and from a texel's size.
#pragma once

#include <cstdint>
#include <span>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

inline constexpr std::uint32_t kChartMargin = 4;  ///< texels beyond the group on every side of the rectangle

struct ChartFrame {
  spatial::Pose X_OC;                          ///< z: the group's mean normal; x: makes its rectangle smallest
  glm::dvec2 patch_low_m{0}, patch_size_m{0};  ///< the group's own extent in C's x-y plane
};
/// Precondition: indices are in range; not empty.
[[nodiscard]] ChartFrame chart_frame(const geometry::TriangleMesh&, std::span<const std::uint32_t> group);

/// Of a side so long, margins included. Precondition: both finite, texel_m > 0, the quotient below 2^31.
[[nodiscard]] std::uint32_t texels_along(double patch_m, double texel_m);
/// The patch in the rectangle's middle, the origin at the rectangle's corner; its first tile is 0. Precondition: as
/// texels_along().
[[nodiscard]] geometry::Chart placed_chart(const ChartFrame&, double texel_m);

}  // namespace farfeel::codecs
