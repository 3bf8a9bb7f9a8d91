// How far what is felt is from what was given, measured both ways at random points.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "slave_sim/bake/bake.h"
#include "slave_sim/bake/displacement.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {

/// From points of the full mesh, spread evenly over its area, to the displaced surface: along its normal where a chart
/// has its own triangles there (or within two texels), or to the nearest of its texels' centres, whichever is less.
[[nodiscard]] Deviation full_to_felt(const geometry::TriangleMesh& full, const geometry::HapticSurface&,
                                     const std::vector<BakedChart>&, std::uint32_t samples);
/// From points of the displaced surface over the charts' own triangles to the nearest point of the full mesh.
[[nodiscard]] Deviation felt_to_full(const geometry::HapticSurface&, const std::vector<BakedChart>&, const FullSurface&,
                                     std::uint32_t samples);

/// How far apart two charts' surfaces are along the coarse edges between them, where the coarse surface bends by less
/// than 30 degrees: the step in height that a stroke across the border feels.
[[nodiscard]] Deviation seam_steps(const geometry::HapticSurface&);

}  // namespace farfeel::slave_sim
