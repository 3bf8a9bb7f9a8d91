#include "codecs/tile/coarse_level.h"

#include <algorithm>
#include <cstdlib>

#include "codecs/tile/number_coder.h"

namespace farfeel::codecs {
namespace {

using geometry::Chart;
using geometry::CoarseHeights;
using geometry::HapticSurface;

constexpr std::int32_t kMostValue = 0xFFFF;

/// Visits every block of a chart, row by row: number(prediction, around) says or takes the difference from it.
template <typename Number>
bool along_blocks(const Chart& chart, std::int32_t first, std::uint16_t* values, Number&& number) {
  const std::size_t across = geometry::blocks_across(chart), down = geometry::blocks_down(chart);
  std::vector<std::int32_t> above(across + 1, 0), here(across + 1, 0);  // differences; [0]: before the first column
  for (std::size_t row = 0; row < down; ++row, above.swap(here)) {
    here[0] = 0;
    for (std::size_t column = 0; column < across; ++column) {
      std::uint16_t* value = values + row * across + column;
      const std::int32_t a = column > 0 ? value[-1] : 0, b = row > 0 ? *(value - across) : 0;
      std::int32_t predicted = first;
      if (row == 0 && column > 0) predicted = a;
      if (row > 0 && column == 0) predicted = b;
      if (row > 0 && column > 0) {
        const std::int32_t c = *(value - across - 1);
        predicted = c >= std::max(a, b) ? std::min(a, b) : (c <= std::min(a, b) ? std::max(a, b) : a + b - c);
      }
      const auto around = 2 * (std::uint64_t{static_cast<std::uint32_t>(std::abs(here[column]))} +
                               static_cast<std::uint32_t>(std::abs(above[column + 1])));
      if (!number(*value, predicted, around, here[column + 1])) return false;
    }
  }
  return true;
}

}  // namespace

std::vector<std::byte> encoded_coarse_level(const HapticSurface& surface, const CoarseHeights& level) {
  std::vector<std::byte> bytes;
  RangeEncoder coder(bytes);
  NumberModels of_values, of_bounds;
  CoarseHeights copy = level;
  std::uint16_t* values = copy.values.data();
  std::int32_t first = 0;
  for (const Chart& chart : surface.charts) {
    along_blocks(chart, first, values,
                 [&](std::uint16_t value, std::int32_t predicted, std::uint64_t around, std::int32_t& difference) {
                   difference = value - predicted;
                   of_values.write(difference, around, coder);
                   return true;
                 });
    first = values[0];
    values += std::size_t{geometry::blocks_across(chart)} * geometry::blocks_down(chart);
  }
  std::int32_t before = 0, difference = 0;
  for (const std::uint16_t off : level.off) {
    const auto around = static_cast<std::uint64_t>(std::abs(difference));
    difference = off - before, before = off;
    of_bounds.write(difference, around, coder);
  }
  coder.finish();
  return bytes;
}

std::optional<CoarseHeights> decoded_coarse_level(const HapticSurface& surface, std::span<const std::byte> bytes) {
  RangeDecoder coder(bytes);
  NumberModels of_values, of_bounds;
  CoarseHeights level;
  level.values.resize(geometry::blocks_of(surface));
  level.off.resize(surface.tiles.size());
  std::uint16_t* values = level.values.data();
  std::int32_t first = 0;
  for (const Chart& chart : surface.charts) {
    const bool is_good =
        along_blocks(chart, first, values,
                     [&](std::uint16_t& value, std::int32_t predicted, std::uint64_t around, std::int32_t& difference) {
                       difference = of_values.read(around, coder);
                       const std::int32_t told = predicted + difference;
                       if (told < 0 || told > kMostValue) return false;
                       value = static_cast<std::uint16_t>(told);
                       return true;
                     });
    if (!is_good) return std::nullopt;
    first = values[0];
    values += std::size_t{geometry::blocks_across(chart)} * geometry::blocks_down(chart);
  }
  std::int32_t before = 0, difference = 0;
  for (std::uint16_t& off : level.off) {
    const auto around = static_cast<std::uint64_t>(std::abs(difference));
    difference = of_bounds.read(around, coder);
    before += difference;
    if (before < 0 || before > kMostValue) return std::nullopt;
    off = static_cast<std::uint16_t>(before);
  }
  if (!coder.is_whole()) return std::nullopt;
  return level;
}

}  // namespace farfeel::codecs
