// The displacement texture: heights of the full mesh over every chart's plane.
#pragma once

#include "codecs/asset/chart_heights.h"
#include "slave_sim/bake/chart_layout.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {

using BakedChart = codecs::ChartHeights;

/// By rays along the chart's axis; see chart_heights().
[[nodiscard]] BakedChart baked_chart(const geometry::TriangleMesh& coarse, const ChartPlan&, double texel_m,
                                     const FullSurface&, double reach_m, int rays_across);

}  // namespace farfeel::slave_sim
