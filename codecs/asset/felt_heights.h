// Height tiles of a felt stream: coefficients as they differ from what their neighbours predict (MED, as in
// codecs/tile/tile_codec.h), with models that all tiles of a surface share, so that small ones are told shortly.
//
// What a chart's tiles repeat is not told: two columns and rows of the tiles before, and beyond the chart its last
// column and row. Flat ones take a byte or two. Tiles of which this is not true are told whole.
#pragma once

#include <cstdint>
#include <span>

#include "codecs/asset/felt_coder.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

class HeightModels {
 public:
  /// A chart's tile in column `across`, row `down`; those before it, row by row, are known.
  template <typename Coder>
  void tell(const geometry::Chart& chart, std::uint32_t across, std::uint32_t down,
            std::span<geometry::HeightTile> chart_tiles, Coder& coder);

 private:
  struct Corner {
    std::size_t column = 0, row = 0;
  };
  using Tile = geometry::HeightTile;
  static constexpr std::size_t kSide = geometry::kTileSide;

  static std::int32_t at(const Tile& tile, std::size_t column, std::size_t row) { return tile.at(column, row); }
  /// The two columns and rows that the tiles before end with.
  static void repeat(const Tile* left, const Tile* above, Tile& to) {
    for (std::size_t k = 0; left != nullptr && k < kSide; ++k) {
      for (std::size_t i = 0; i < 2; ++i) to.coefficients[k * kSide + i] = left->at(kSide - 2 + i, k);
    }
    for (std::size_t k = 0; above != nullptr && k < kSide; ++k) {
      for (std::size_t j = 0; j < 2; ++j) to.coefficients[j * kSide + k] = above->at(k, kSide - 2 + j);
    }
  }
  /// From `end` on, the last column and row.
  static void repeat_beyond(const Corner& end, Tile& to) {
    for (std::size_t j = 0; j < kSide; ++j) {
      for (std::size_t i = 0; i < kSide; ++i)
        to.coefficients[j * kSide + i] = to.at(std::min(i, end.column - 1), std::min(j, end.row - 1));
    }
  }
  template <typename Coder>
  void tell_version(Tile& tile, Coder& coder) {
    bool is_as_before = tile.version == version_;
    coder.bit(is_as_before, is_as_before_);
    if (is_as_before) {
      tile.version = version_;
    } else {
      coder.plain(tile.version);
    }
    version_ = tile.version;
  }
  template <typename Coder>
  void tell_rectangle(Tile& tile, const Corner& first, const Corner& end, Coder& coder);

  BitModel is_as_before_, is_regular_;
  NumberModels firsts_, others_;
  std::uint32_t version_ = 0;
  std::int32_t last_first_ = 0;
};

template <typename Coder>
void HeightModels::tell_rectangle(Tile& tile, const Corner& first, const Corner& end, Coder& coder) {
  constexpr std::size_t kStride = kSide + 3;  // a border of zeros: two to the left, one to the right, two rows above
  std::array<std::uint32_t, kStride*(kSide + 2)> magnitudes{};
  for (std::size_t row = first.row; row < end.row; ++row) {
    for (std::size_t column = first.column; column < end.column; ++column) {
      std::uint16_t& value = tile.coefficients[row * kSide + column];
      std::uint32_t* size = &magnitudes[(row + 2) * kStride + column + 2];
      const std::uint32_t* above = size - kStride;
      const bool is_first = row == 0 && column == 0;
      std::int32_t predicted = last_first_;
      if (row == 0 && column > 0) predicted = at(tile, column - 1, row);
      if (row > 0 && column == 0) predicted = at(tile, column, row - 1);
      if (row > 0 && column > 0) {
        const std::int32_t a = at(tile, column - 1, row), b = at(tile, column, row - 1),
                           c = at(tile, column - 1, row - 1);
        predicted = c >= std::max(a, b) ? std::min(a, b) : (c <= std::min(a, b) ? std::max(a, b) : a + b - c);
      }
      const std::uint64_t around =
          2 * (std::uint64_t{size[-1]} + *above) + above[-1] + above[1] + size[-2] + *(above - kStride);
      std::int32_t off = value - predicted;
      coder.number(off, around, is_first ? firsts_ : others_);
      if (!is_first) *size = static_cast<std::uint32_t>(std::abs(off));
      value = static_cast<std::uint16_t>(std::clamp(predicted + off, 0, 65535));
      if (is_first) last_first_ = value;
    }
  }
}

template <typename Coder>
void HeightModels::tell(const geometry::Chart& chart, std::uint32_t across, std::uint32_t down,
                        std::span<geometry::HeightTile> chart_tiles, Coder& coder) {
  const std::size_t index = std::size_t{down} * chart.tiles_across() + across;
  Tile& tile = chart_tiles[index];
  const Tile* left = across > 0 ? &chart_tiles[index - 1] : nullptr;
  const Tile* above = down > 0 ? &chart_tiles[index - chart.tiles_across()] : nullptr;
  const Corner first{left != nullptr ? 2U : 0U, above != nullptr ? 2U : 0U};
  const Corner end{std::min<std::size_t>(kSide, chart.columns + 2 - std::size_t{across} * geometry::kTileTexels),
                   std::min<std::size_t>(kSide, chart.rows + 2 - std::size_t{down} * geometry::kTileTexels)};
  tell_version(tile, coder);
  bool is_regular = true;
  if constexpr (!Coder::kReads) {
    Tile as_read = tile;
    repeat(left, above, as_read);
    repeat_beyond(end, as_read);
    is_regular = as_read.coefficients == tile.coefficients;
  }
  coder.bit(is_regular, is_regular_);
  if (!is_regular) return tell_rectangle(tile, {}, {kSide, kSide}, coder);
  repeat(left, above, tile);
  tell_rectangle(tile, first, end, coder);
  repeat_beyond(end, tile);
}

}  // namespace farfeel::codecs
