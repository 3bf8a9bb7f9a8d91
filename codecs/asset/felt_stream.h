// What is felt of an asset as one stream of bytes: any surface exactly, and shortly where the bake made it so: in
// stored_order(), its numbers on grids.
//
// All is told by one range coder (codecs/tile/range_coder.h), its numbers as codecs/tile/number_coder.h says, in this
// order; FARFEEL_haptic_surface.schema.json says what each means:
//   triangles  one after another, by the edge that each hangs on and what lies across it (felt_triangles.h)
//   positions  i8 grid's exponent, or none; then each vertex, as it differs from the parallelogram's corner
//   charts     of triangles, then pieces of triangles: a neighbour's, or the next new one, or any
//   thickness  of pieces
//   frames     of charts, sizes, texels
//   heights    tile by tile, without what repeats: the neighbours' borders, and what lies beyond the chart; or, if
//              there is such a mesh, in place of frames and heights the triangles and positions of what they follow
//              from (followed_heights.h)
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

/// How many there are of each: told apart from the stream, and bounded before it is read.
struct FeltCounts {
  std::uint32_t vertices = 0, triangles = 0, pieces = 0, charts = 0, tiles = 0;
  std::uint32_t detail_vertices = 0, detail_triangles = 0;  ///< of the mesh that heights follow from
};
inline constexpr std::uint32_t kMostFeltElements = 1U << 20;  ///< vertices, triangles, pieces, charts
inline constexpr std::uint32_t kMostFeltTiles = 1U << 17;     ///< 268 MB of heights

[[nodiscard]] FeltCounts counts_of(const geometry::HapticSurface&, const geometry::TriangleMesh& detail = {});
/// Its counts are within bounds, and its charts' tiles stand one after the other.
[[nodiscard]] bool can_be_told(const geometry::HapticSurface&);

/// Preconditions: a surface without faults, whose thickness is known; can_be_told(). The scale is not told, nor are
/// charts and heights that follow from a detail.
[[nodiscard]] std::vector<std::byte> encoded_felt(const geometry::HapticSurface&,
                                                  const geometry::TriangleMesh& detail = {});
/// Bytes may be hostile: nothing unless they are what an encoder writes. Takes memory as it reads, and no more than
/// the counts say. What comes back may have faults; with a detail it has no charts and tiles yet. Precondition: counts
/// within bounds.
[[nodiscard]] std::optional<geometry::HapticSurface> decoded_felt(std::span<const std::byte>, const FeltCounts&,
                                                                  geometry::TriangleMesh* detail = nullptr);

/// The same surface with its triangles, vertices, pieces and charts numbered as they are met along edges.
[[nodiscard]] geometry::HapticSurface stored_order(const geometry::HapticSurface&);
[[nodiscard]] geometry::TriangleMesh stored_order(const geometry::TriangleMesh&);
/// A chart's frame nearest to this one of those that are told in few bits: the turn within half a degree, the place
/// on a grid of step_m, a power of two.
[[nodiscard]] spatial::Pose frame_on_grid(const spatial::Pose& X_OH, double step_m);

}  // namespace farfeel::codecs
