// A small felt surface in closed form, for tests and demonstrations that need no bake.
#pragma once

#include <functional>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::slave_sim {

struct PlateSize {
  glm::dvec3 size_m{0.040, 0.030, 0.004};
  double texel_m = 1e-4;
};

/// A box whose upper face lies in z = 0 and carries z = height_m(x, y) over |x| <= size.x / 2, |y| <= size.y / 2 (and
/// some texels beyond); its other faces carry no texture. One convex piece of 12 triangles, one chart.
[[nodiscard]] geometry::HapticSurface height_plate(const std::function<double(double x_m, double y_m)>& height_m,
                                                   const PlateSize& = {});

/// z = depth/2 (cos(2 pi x / period) - 1): rounded ridges along y, a crest at x = 0.
[[nodiscard]] geometry::HapticSurface ridged_plate(double period_m, double depth_m, const PlateSize& = {});

}  // namespace farfeel::slave_sim
