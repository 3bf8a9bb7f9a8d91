// Inside one texel a quadratic B-spline is a Bezier patch, which its control points bound: along one axis those are
// (c0 + c1) / 2, c1, (c1 + c2) / 2. Its second derivatives are convex sums of the coefficients' second differences, its
// mixed derivative of the four corners' mixed differences, and the greatest eigenvalue of the two-by-two matrix is at
// most the greater diagonal entry plus the off-diagonal's size.
#include "haptic_core/penetration/height_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace farfeel::penetration {
namespace {

std::uint32_t entry_of(int height, int bend) {
  return static_cast<std::uint32_t>(height) | static_cast<std::uint32_t>(bend) << 16;
}
std::uint32_t greater_of(std::uint32_t a, std::uint32_t b) {
  return std::max(a & 0xFFFFu, b & 0xFFFFu) | std::max(a & 0xFFFF'0000u, b & 0xFFFF'0000u);
}

/// c: the texel's first coefficient; stride to the next row.
std::uint32_t texel_bounds(const std::uint16_t* c, std::uint32_t stride) {
  std::array<std::array<int, 3>, 3> at;
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t i = 0; i < 3; ++i) at[j][i] = c[j * stride + i];
  }
  int highest = 0;  // four times the height
  for (std::size_t j = 0; j < 3; ++j) {
    const std::array<int, 3> row{at[j][0] + at[j][1], 2 * at[j][1], at[j][1] + at[j][2]};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::array<int, 3> middle{at[1][0] + at[1][1], 2 * at[1][1], at[1][1] + at[1][2]};
      highest = std::max(highest, j == 1 ? 2 * row[i] : row[i] + middle[i]);
    }
  }
  int along = 0, mixed = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    along = std::max({along, at[k][0] - 2 * at[k][1] + at[k][2], at[0][k] - 2 * at[1][k] + at[2][k]});
  }
  for (std::size_t j = 0; j < 2; ++j) {
    for (std::size_t i = 0; i < 2; ++i) {
      mixed = std::max(mixed, std::abs(at[j][i] - at[j][i + 1] - at[j + 1][i] + at[j + 1][i + 1]));
    }
  }
  const auto bend = static_cast<int>(std::ceil((along + mixed) / kBendUnit));
  return entry_of((highest + 3) / 4, std::min(bend, 0xFFFF));
}

}  // namespace

HeightBounds::HeightBounds(const std::uint16_t* coefficients, std::uint32_t columns, std::uint32_t rows) {
  const Part all{0, columns, 0, rows};
  std::size_t size = 0;
  for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
    levels_.push_back({size, columns, rows});
    size += std::size_t{columns} * rows;
    columns = (columns + 1) / 2;
    rows = (rows + 1) / 2;
  }
  blocks_.resize(size);
  entries_.resize(size);
  update(coefficients, all);
}

void HeightBounds::update(const std::uint16_t* coefficients, Part part) noexcept {
  for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
    const auto [first, columns, rows] = levels_[level];
    std::uint32_t* blocks = &blocks_[first];
    part.end_column = std::min(part.end_column, columns);
    part.end_row = std::min(part.end_row, rows);
    for (std::uint32_t j = part.first_row; j < part.end_row; ++j) {
      for (std::uint32_t i = part.first_column; i < part.end_column; ++i) {
        std::uint32_t& block = blocks[std::size_t{j} * columns + i];
        if (level == 0) {
          block = texel_bounds(coefficients + std::size_t{j} * (columns + 2) + i, columns + 2);
          continue;
        }
        const auto [finer_first, finer_columns, finer_rows] = levels_[level - 1];
        const std::uint32_t* row = &blocks_[finer_first + std::size_t{2 * j} * finer_columns + 2 * i];
        const std::uint32_t right = 2 * i + 1 < finer_columns ? 1 : 0;
        const std::uint32_t below = 2 * j + 1 < finer_rows ? finer_columns : 0;
        block = greater_of(greater_of(row[0], row[right]), greater_of(row[below], row[below + right]));
      }
    }
    // Grown by one block on every side.
    const std::uint32_t end_column = std::min(part.end_column + 1, columns), end_row = std::min(part.end_row + 1, rows);
    for (std::uint32_t j = part.first_row - (part.first_row > 0); j < end_row; ++j) {
      const std::uint32_t* row = blocks + std::size_t{j} * columns;
      const std::uint32_t *above = row - (j > 0 ? columns : 0), *below = row + (j + 1 < rows ? columns : 0);
      for (std::uint32_t i = part.first_column - (part.first_column > 0); i < end_column; ++i) {
        const std::uint32_t left = i - (i > 0), right = std::min(i + 1, columns - 1);
        const auto wide = [&](const std::uint32_t* r) { return greater_of(r[i], greater_of(r[left], r[right])); };
        entries_[first + std::size_t{j} * columns + i] = greater_of(wide(row), greater_of(wide(above), wide(below)));
      }
    }
    part = {part.first_column / 2, (part.end_column + 1) / 2, part.first_row / 2, (part.end_row + 1) / 2};
  }
}

BoundsLevel HeightBounds::level(std::uint32_t level) const {
  const Place& place = levels_[level];
  return {entries_.data() + place.first, place.columns, place.rows};
}

}  // namespace farfeel::penetration
