// The displacement texture: heights of the full mesh over every chart's plane.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/height_field_fit.h"
#include "slave_sim/bake/chart_layout.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {

struct BakedChart {
  geometry::SampledChart heights;
  std::vector<bool> is_own;           ///< per texel: its centre is under one of the chart's own triangles
  std::uint64_t own = 0, missed = 0;  ///< own texels, and those of them where no ray found the full mesh
};

/// rays_across x rays_across rays a texel along the chart's axis: one gives heights at texels' centres, more their
/// means, so that what is finer than the texels is left out instead of aliased. Where the full mesh goes on beyond the
/// chart's own triangles the texels follow it, so that neighbouring charts describe the same surface; where it ends (an
/// edge, a gap) they go on smoothly. reach_m: how far the full mesh may be from the coarse one.
[[nodiscard]] BakedChart baked_chart(const geometry::TriangleMesh& coarse, const ChartPlan&, double texel_m,
                                     const FullSurface&, double reach_m, int rays_across);

}  // namespace farfeel::slave_sim
