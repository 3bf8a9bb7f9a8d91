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
/// has its own triangles there (or within two texels: so far a chart is felt beyond them), or to the nearest of its
/// texels' centres (of every second or third, from a million texels on), whichever is less. What the charts leave out
/// counts with its whole distance, and so do the triangles of left_out, whose corners are looked at, too.
[[nodiscard]] Deviation full_to_felt(const geometry::TriangleMesh& full, const geometry::TriangleMesh& left_out,
                                     const geometry::HapticSurface&, const std::vector<BakedChart>&,
                                     std::uint32_t samples);
struct FeltDeviation {
  Deviation height;
  SlopeDeviation slope;
};

/// The median over the mesh's area of the way from there straight inwards to where it is left again. Of nothing closed:
/// infinite.
[[nodiscard]] double median_thickness_m(const geometry::TriangleMesh&, const FullSurface&, std::uint32_t samples);

/// From points of the displaced surface, by its area, over the charts' own triangles to the nearest point of the full
/// mesh: all of them, those beyond an edge of the full mesh and those over its gaps too. The slopes leave out points
/// whose nearest one faces more than 60 degrees away: it is on the other side of an edge.
[[nodiscard]] FeltDeviation felt_to_full(const geometry::HapticSurface&, const std::vector<BakedChart>&,
                                         const FullSurface&, std::uint32_t samples);

/// How far apart two charts' surfaces are along the coarse edges between them, where the coarse surface bends by less
/// than 30 degrees: the steps in height and slope that a stroke across the border feels.
[[nodiscard]] FeltDeviation seam_steps(const geometry::HapticSurface&);

/// What a felt surface is held against, in its frame.
struct Given {
  const geometry::TriangleMesh& full;
  const geometry::TriangleMesh& left_out;  ///< see full_to_felt()
  const FullSurface& surface;              ///< full's
};
/// All of that into the report, places in the mesh's own frame.
void tell_deviation(const Given&, const geometry::HapticSurface&, const std::vector<BakedChart>&, BakeReport&);

}  // namespace farfeel::slave_sim
