// A tile's worth of numbers as discrete Chebyshev (Gram) polynomials: the orthonormal ones on 32 points, in both
// directions.
//
// Smooth relief needs few of them, whatever it does at the tile's border, where cosines would see a jump of slope; cf.
// Mukundan, Ong & Lee 2001, Image analysis by Tchebichef moments.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/geometry/height_tile.h"

namespace farfeel::codecs {

/// Row by row; as a spectrum: the degree along a row in the columns, down a column in the rows.
using TileNumbers = std::array<double, std::size_t{geometry::kTileSide} * geometry::kTileSide>;

[[nodiscard]] TileNumbers smooth_spectrum(const TileNumbers& values) noexcept;
/// Its inverse, of a spectrum that is zero where the two degrees add up to more than most_degree.
[[nodiscard]] TileNumbers values_of_spectrum(const TileNumbers& spectrum, std::size_t most_degree) noexcept;

}  // namespace farfeel::codecs
