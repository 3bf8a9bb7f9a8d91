// How fine the full surface is, and how much of that a texel size loses.
#pragma once

#include <vector>

#include "slave_sim/bake/chart_layout.h"
#include "slave_sim/bake/displacement.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {

struct Fineness {
  double rms_m = 0;            ///< of heights about the smooth shape, over windows of some ten texels
  double lost_share = 0;       ///< of their variance, at wavelengths shorter than two texels
  double keeping_texel_m = 0;  ///< the largest texel that would lose less than a thousandth
};

/// From straight scans of the full mesh at random places, each with its best parabola removed, through a Hann window.
/// edge_m: mean edge of the full mesh, below which there is nothing to find; size_m: the mesh's, a fifth of which is
/// the longest scan.
[[nodiscard]] Fineness fineness(const ChartLayout&, const std::vector<BakedChart>&, const FullSurface&, double edge_m,
                                double size_m);

}  // namespace farfeel::slave_sim
