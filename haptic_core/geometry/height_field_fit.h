// From sampled heights to the tiles of a haptic surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::geometry {

/// Heights over a chart's plane at every texel's centre: texel (i, j) at ((i + 1/2) texel_m, (j + 1/2) texel_m).
struct SampledChart {
  spatial::Pose X_OH;
  double texel_m;                 ///< > 0
  std::uint32_t columns, rows;    ///< >= 1
  std::vector<double> heights_m;  ///< row by row, columns * rows, finite
  bool are_means = false;         ///< heights are means over each texel's square instead of values at its centre
};

/// Replaces the surface's charts, tiles and height scale. The coefficients reproduce what was sampled: sample_height()
/// at a texel's centre (or its mean over the texel) is the sampled height within the scale's rounding, half of (range
/// of all coefficients) / 65535. Across the rectangle's border the field is continued straight.
void set_height_fields(HapticSurface&, std::span<const SampledChart>);

}  // namespace farfeel::geometry
