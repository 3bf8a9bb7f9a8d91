// One tile: 30 x 30 texels of a chart's height field with a border of one, 32 x 32 coefficients in all.
//
// The tile is the unit of the displacement texture, of surface edits, of the wire and of the local model's cache. With
// its border it is complete: the quadratic B-spline of texel (i, j) needs coefficients i-1..i+1, j-1..j+1 and nothing
// from a neighbour. Neighbouring tiles repeat each other's two columns (rows), with equal values and one scale, so the
// height field and its slope are continuous across them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace farfeel::geometry {

inline constexpr std::uint32_t kTileSide = 32;               ///< coefficients along a tile's side
inline constexpr std::uint32_t kTileTexels = kTileSide - 2;  ///< texels along a tile's side

/// Metres of a stored coefficient: offset_m + scale_m * coefficient. One scale for a whole surface.
struct HeightScale {
  double offset_m = 0;
  double scale_m = 1e-6;  ///< > 0

  [[nodiscard]] double height_m(std::uint16_t coefficient) const { return offset_m + scale_m * coefficient; }
};

struct HeightTile {
  std::uint32_t version = 0;  ///< grows with every edit
  /// B-spline coefficients, row by row; [row * kTileSide + column]. Local texel (i, j), 0 <= i, j < 30, has its
  /// centre coefficient at column i + 1, row j + 1.
  std::array<std::uint16_t, kTileSide * kTileSide> coefficients{};

  [[nodiscard]] std::uint16_t at(std::size_t column, std::size_t row) const {
    return coefficients[row * kTileSide + column];
  }
};

}  // namespace farfeel::geometry
