// What is felt in numbers that an asset's felt stream (codecs/asset/felt_stream.h) tells shortly. Vertices, thicknesses
// and charts' frames are rounded before heights are measured against them, so that this costs no error; heights cost
// what they are rounded by.
#pragma once

#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "slave_sim/bake/chart_layout.h"
#include "slave_sim/bake/displacement.h"

namespace farfeel::slave_sim {

/// Its vertices on the coarsest grid that moves them by 50 um and 1/2048 of the size at most, and turns no triangle
/// over; as it was where there is none.
[[nodiscard]] geometry::TriangleMesh on_grid(const geometry::TriangleMesh&);

/// Each within half a degree, and a quarter of a texel, of where it was.
void put_frames_on_grid(ChartLayout&);

/// Rounded down, by 6 % at most.
void round_thickness(std::vector<double>& piece_thickness_m);

/// Heights in steps of step_m, unless they are coarser already. Where nobody looks, which is farther from a chart's own
/// texels than two, they become what the felt stream expects of their neighbours, between the least and the greatest
/// of these.
void round_heights(geometry::HapticSurface&, const std::vector<BakedChart>&, double step_m);

}  // namespace farfeel::slave_sim
