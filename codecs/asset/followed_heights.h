// Heights that follow from a mesh: an asset that carries it in place of its tiles takes a few bytes a triangle, where
// tiles take some bits a texel. Whoever writes the asset and whoever reads it make the same tiles of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codecs/asset/chart_heights.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

/// What heights follow from: the curved surface through its vertices (curved_mesh.h), as far as it is within reach_m of
/// the coarse mesh. Without triangles: heights are told one by one.
struct FeltDetail {
  geometry::TriangleMesh mesh;
  double reach_m = 0;
  double texel_m = 0;  ///< of all charts, which follow from the coarse mesh and its triangles' charts (chart_frame.h)
};

inline constexpr std::uint64_t kMostFollowedTexels = 1U << 24;

/// Gives the surface, of which the coarse mesh and its triangles' charts are known, the charts, tiles and scale that
/// follow. Nothing where that would take more work or memory than a bake's do, or a chart has no triangle: any numbers
/// may stand in either, but for indices out of range.
[[nodiscard]] std::optional<std::vector<ChartHeights>> follow(geometry::HapticSurface&, std::uint32_t charts,
                                                              const FeltDetail&);

}  // namespace farfeel::codecs
