// The coarsest level of a surface's heights as bytes: some nine numbers a tile, a byte or less each.
//
// Told by a range coder (range_coder.h) as number_coder.h says, in two sequences with models of their own. First the
// values, chart by chart, row by row, each as its difference from what the left, upper and upper left neighbours
// predict (MED, as in tile_codec.h); the first of a chart from the first of the chart before. Then the tiles' bounds,
// each as its difference from the one before.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/geometry/coarse_heights.h"

namespace farfeel::codecs {

/// The surface's charts alone are looked at.
[[nodiscard]] std::vector<std::byte> encoded_coarse_level(const geometry::HapticSurface&,
                                                          const geometry::CoarseHeights&);

/// Bytes may be hostile: nothing unless they are what an encoder writes for those charts, no more and no less.
/// Precondition: the charts' tiles are of a number that is worth the memory.
[[nodiscard]] std::optional<geometry::CoarseHeights> decoded_coarse_level(const geometry::HapticSurface&,
                                                                          std::span<const std::byte>);

}  // namespace farfeel::codecs
