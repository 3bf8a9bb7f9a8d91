// The coarsest level of a surface's heights: a value a block of texels, and how far off it is at most.
//
// It stands in for height tiles that are not at hand. Over a chart the values are control points of a quadratic
// B-spline whose knots are the blocks' sides, so what stands in is as smooth as the heights themselves: a dome stays a
// dome, and only what is finer than a block is missing. Whole numbers alone decide, so any two machines agree.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::geometry {

/// Texels along a block's side: nine blocks a tile. With blocks half as long what is missing is a third less, and the
/// level takes four times the bytes.
inline constexpr std::uint32_t kBlockTexels = 10;
/// Values are told in steps of about this: a fortieth of the deviation that counts as felt at first touch [m].
inline constexpr double kCoarseStep_m = 4e-6;

struct CoarseHeights {
  /// In steps: block (i, j) of a chart at j * blocks_across(chart) + i behind the charts before it; <= 65535.
  std::vector<std::uint16_t> values;
  /// A tile, in steps: no height of it is farther from what stands in. 0: they are equal to within half a step.
  std::vector<std::uint16_t> off;
};

[[nodiscard]] constexpr std::uint32_t blocks_across(const Chart& chart) {
  return (chart.columns + kBlockTexels - 1) / kBlockTexels;
}
[[nodiscard]] constexpr std::uint32_t blocks_down(const Chart& chart) {
  return (chart.rows + kBlockTexels - 1) / kBlockTexels;
}
/// Of all charts.
[[nodiscard]] std::size_t blocks_of(const HapticSurface&) noexcept;

/// One step, in coefficients; >= 1.
[[nodiscard]] std::uint32_t coarse_step(const HeightScale&) noexcept;

/// Fitted to the surface's tiles, and their bound measured on what stand_in() makes of it.
[[nodiscard]] CoarseHeights coarse_heights(const HapticSurface&);

/// Another version of a tile may come: the bound of what stands in holds for it, too.
void widen_bound(CoarseHeights&, const HapticSurface&, std::uint32_t tile, const HeightTile& version);

/// Replaces all tiles' coefficients by those that the level makes. Precondition: level.values.size() == blocks_of().
void stand_in(HapticSurface&, const CoarseHeights& level);

}  // namespace farfeel::geometry
