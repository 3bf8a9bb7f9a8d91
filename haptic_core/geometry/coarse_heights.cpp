#include "haptic_core/geometry/coarse_heights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace farfeel::geometry {
namespace {

constexpr std::int64_t kBlock = kBlockTexels;
/// The weights of a spline's three control points at a texel's middle, times this: ((2 B - k)^2, ..., k^2) / 8 B^2 with
/// k = 2 texel + 1.
constexpr std::int64_t kWhole = 8 * kBlock * kBlock;
constexpr int kFits =
    4;  // the farthest from fitting, a chequerboard of blocks, has (8/9)^4 of its error left: no matter
constexpr std::int64_t kMostValue = 0xFFFF;

/// Which control point is the middle one at a texel, and the weights of the one before, it and the one behind.
struct Place {
  std::int64_t block;
  std::array<std::int64_t, 3> weights;
};
Place place_of(std::int64_t texel) {
  const std::int64_t block = texel >= 0 ? texel / kBlock : -((kBlock - 1 - texel) / kBlock);
  const std::int64_t k = 2 * (texel - block * kBlock) + 1, before = (2 * kBlock - k) * (2 * kBlock - k), behind = k * k;
  return {block, {before, kWhole - before - behind, behind}};
}

/// Value i of n; beyond the ends as the last two go on.
std::int64_t value_at(const std::int64_t* values, std::int64_t n, std::int64_t stride, std::int64_t i) {
  if (i >= 0 && i < n) return values[i * stride];
  const std::int64_t end = i < 0 ? 0 : n - 1, inner = n == 1 ? end : (i < 0 ? 1 : n - 2);
  const std::int64_t slope = values[end * stride] - values[inner * stride];
  return values[end * stride] + slope * std::abs(i - end);
}

/// A chart's values in units of coefficients, and what they make of each texel.
class Level {
 public:
  explicit Level(const Chart& chart)
      : across_(blocks_across(chart)),
        down_(blocks_down(chart)),
        values_(std::size_t{blocks_across(chart)} * blocks_down(chart)) {}

  [[nodiscard]] std::span<std::int64_t> values() { return values_; }

  /// Coefficients of a tile-sized square from a texel on, not clamped.
  void square(std::int64_t first_column, std::int64_t first_row,
              std::array<std::int64_t, std::size_t{kTileSide} * kTileSide>& to) {
    rows_.resize(static_cast<std::size_t>(down_) * kTileSide);
    // Beyond the chart's ends the last two values go on: they are needed there too.
    const std::int64_t low =
        std::clamp<std::int64_t>(place_of(first_row).block - 1, 0, std::max<std::int64_t>(down_ - 2, 0));
    const std::int64_t high = std::clamp<std::int64_t>(place_of(first_row + kTileSide - 1).block + 1,
                                                       std::min<std::int64_t>(1, down_ - 1), down_ - 1);
    for (std::int64_t column = 0; column < kTileSide; ++column) {
      const Place at = place_of(first_column + column);
      for (std::int64_t row = low; row <= high; ++row) {
        std::int64_t sum = 0;
        for (std::int64_t k = 0; k < 3; ++k)
          sum += at.weights[static_cast<std::size_t>(k)] *
                 value_at(&values_[static_cast<std::size_t>(row * across_)], across_, 1, at.block + k - 1);
        rows_[static_cast<std::size_t>(row * kTileSide + column)] = sum;
      }
    }
    for (std::int64_t row = 0; row < kTileSide; ++row) {
      const Place at = place_of(first_row + row);
      for (std::int64_t column = 0; column < kTileSide; ++column) {
        std::int64_t sum = 0;
        for (std::int64_t k = 0; k < 3; ++k)
          sum += at.weights[static_cast<std::size_t>(k)] *
                 value_at(&rows_[static_cast<std::size_t>(column)], down_, kTileSide, at.block + k - 1);
        constexpr std::int64_t kUnit = kWhole * kWhole;
        const std::int64_t rounded = sum >= 0 ? (sum + kUnit / 2) / kUnit : -((kUnit / 2 - sum) / kUnit);
        to[static_cast<std::size_t>(row * kTileSide + column)] = rounded;
      }
    }
  }

 private:
  std::int64_t across_, down_;
  std::vector<std::int64_t> values_, rows_;
};

using Square = std::array<std::int64_t, std::size_t{kTileSide} * kTileSide>;

/// A tile of a chart: which texel its first coefficient belongs to, and how many of its coefficients count.
struct TileSquare {
  std::int64_t first_column, first_row;
  std::uint32_t columns, rows;
};
TileSquare square_of(const Chart& chart, std::uint32_t tile) {
  const std::uint32_t i = tile % chart.tiles_across() * kTileTexels, j = tile / chart.tiles_across() * kTileTexels;
  return {std::int64_t{i} - 1, std::int64_t{j} - 1, std::min(kTileSide, chart.columns + 2 - i),
          std::min(kTileSide, chart.rows + 2 - j)};
}

/// How much higher the tiles are than the level, on the mean of each block [coefficients].
std::vector<double> missing(const HapticSurface& surface, const Chart& chart, Level& level) {
  std::vector<double> sums(level.values().size(), 0.0), counts(sums.size(), 0.0);
  Square square;
  for (std::uint32_t tile = 0; tile < chart.tiles_across() * chart.tiles_down(); ++tile) {
    const TileSquare at = square_of(chart, tile);
    level.square(at.first_column, at.first_row, square);
    for (std::uint32_t row = 1; row + 1 < at.rows; ++row) {
      for (std::uint32_t column = 1; column + 1 < at.columns; ++column) {
        const std::size_t block = static_cast<std::size_t>((at.first_row + row) / kBlock) * blocks_across(chart) +
                                  static_cast<std::size_t>((at.first_column + column) / kBlock);
        sums[block] += static_cast<double>(surface.tiles[chart.first_tile + tile].at(column, row) -
                                           square[std::size_t{row} * kTileSide + column]);
        ++counts[block];
      }
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= std::max(counts[i], 1.0);
  return sums;
}

/// How far a tile's heights are from what the level makes there, in steps.
std::uint16_t steps_off(Level& level, const Chart& chart, std::uint32_t tile, const HeightTile& heights,
                        std::int64_t step, Square& square) {
  const TileSquare at = square_of(chart, tile);
  level.square(at.first_column, at.first_row, square);
  std::int64_t most = 0;
  for (std::uint32_t row = 0; row < at.rows; ++row) {
    for (std::uint32_t column = 0; column < at.columns; ++column) {
      const std::int64_t made = std::clamp<std::int64_t>(square[std::size_t{row} * kTileSide + column], 0, kMostValue);
      most = std::max<std::int64_t>(most, std::abs(heights.at(column, row) - made));
    }
  }
  return static_cast<std::uint16_t>(std::min<std::int64_t>((most + step - 1) / step, kMostValue));
}

}  // namespace

std::size_t blocks_of(const HapticSurface& surface) noexcept {
  std::size_t count = 0;
  for (const Chart& chart : surface.charts) count += std::size_t{blocks_across(chart)} * blocks_down(chart);
  return count;
}

std::uint32_t coarse_step(const HeightScale& scale) noexcept {
  return static_cast<std::uint32_t>(std::clamp(std::round(kCoarseStep_m / scale.scale_m), 1.0, 1e4));
}

CoarseHeights coarse_heights(const HapticSurface& surface) {
  const std::int64_t step = coarse_step(surface.scale);
  CoarseHeights heights;
  heights.off.resize(surface.tiles.size());
  Square square;
  for (const Chart& chart : surface.charts) {
    Level level(chart);
    std::vector<double> fitted(level.values().size(), 0.0);
    const auto rounded_to = [&](std::int64_t unit) {
      for (std::size_t i = 0; i < fitted.size(); ++i) {
        const double whole = std::round(fitted[i] / static_cast<double>(unit));
        level.values()[i] = unit * std::clamp<std::int64_t>(static_cast<std::int64_t>(whole), 0, kMostValue);
      }
    };
    for (int fit = 0; fit < kFits; ++fit) {
      rounded_to(1);
      const std::vector<double> more = missing(surface, chart, level);
      for (std::size_t i = 0; i < fitted.size(); ++i) fitted[i] += more[i];
    }
    rounded_to(step);
    for (const std::int64_t value : level.values()) heights.values.push_back(static_cast<std::uint16_t>(value / step));
    for (std::uint32_t tile = 0; tile < chart.tiles_across() * chart.tiles_down(); ++tile)
      heights.off[chart.first_tile + tile] =
          steps_off(level, chart, tile, surface.tiles[chart.first_tile + tile], step, square);
  }
  return heights;
}

void widen_bound(CoarseHeights& heights, const HapticSurface& surface, std::uint32_t tile, const HeightTile& version) {
  const std::int64_t step = coarse_step(surface.scale);
  std::size_t next = 0;
  Square square;
  for (const Chart& chart : surface.charts) {
    const std::uint32_t tiles = chart.tiles_across() * chart.tiles_down();
    const std::size_t blocks = std::size_t{blocks_across(chart)} * blocks_down(chart);
    if (tile < chart.first_tile || tile >= chart.first_tile + tiles) {
      next += blocks;
      continue;
    }
    Level level(chart);
    for (std::int64_t& value : level.values()) value = step * heights.values[next++];
    heights.off[tile] =
        std::max(heights.off[tile], steps_off(level, chart, tile - chart.first_tile, version, step, square));
    return;
  }
}

void stand_in(HapticSurface& surface, const CoarseHeights& heights) {
  const std::int64_t step = coarse_step(surface.scale);
  std::size_t next = 0;
  Square square;
  for (const Chart& chart : surface.charts) {
    Level level(chart);
    for (std::int64_t& value : level.values()) value = step * heights.values[next++];
    for (std::uint32_t tile = 0; tile < chart.tiles_across() * chart.tiles_down(); ++tile) {
      const TileSquare at = square_of(chart, tile);
      level.square(at.first_column, at.first_row, square);
      auto& coefficients = surface.tiles[chart.first_tile + tile].coefficients;
      for (std::size_t i = 0; i < square.size(); ++i)
        coefficients[i] = static_cast<std::uint16_t>(std::clamp<std::int64_t>(square[i], 0, kMostValue));
    }
  }
}

}  // namespace farfeel::geometry
