// Rectangular plates with a height function: surfaces whose overlap can be written down.
#pragma once

#include <functional>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::support {

struct PlateSize {
  double width_m = 0.02, depth_m = 0.02;  ///< along x and y, centred on the origin
  double texel_m = 0.05e-3;
  double margin_m = 0.5e-3;  ///< how far the chart goes beyond the plate
};

/// Two coarse triangles in z = 0 that face +z, one piece, no chart.
[[nodiscard]] geometry::HapticSurface flat_plate(const PlateSize&);

/// The same plate with one chart over it whose felt height is height(x, y) [m]. The field
/// interpolates it at the texels' centres within the stored heights' rounding, (range / 65535) / 2.
[[nodiscard]] geometry::HapticSurface textured_plate(const PlateSize&,
                                                     const std::function<double(double, double)>& height_m);

/// Both plates in one surface, the second moved by `offset`, as separate pieces 0 and 1. Same height scale required.
[[nodiscard]] geometry::HapticSurface stacked(const geometry::HapticSurface& first,
                                              const geometry::HapticSurface& second, const glm::dvec3& offset);

}  // namespace farfeel::support
