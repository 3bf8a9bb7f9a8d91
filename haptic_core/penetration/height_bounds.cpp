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
  std::vector<std::uint32_t> blocks(std::size_t{columns} * rows);
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      blocks[std::size_t{j} * columns + i] =
          texel_bounds(coefficients + std::size_t{j} * (columns + 2) + i, columns + 2);
    }
  }
  for (std::uint32_t level = 0; level < kBoundsLevels; ++level) {
    levels_.push_back({entries_.size(), columns, rows});
    // Grown by one block on every side: first along rows, then down columns.
    std::vector<std::uint32_t> wide(blocks.size());
    for (std::uint32_t j = 0; j < rows; ++j) {
      const std::uint32_t* row = &blocks[std::size_t{j} * columns];
      for (std::uint32_t i = 0; i < columns; ++i) {
        wide[std::size_t{j} * columns + i] =
            greater_of(row[i], greater_of(row[i - (i > 0)], row[std::min(i + 1, columns - 1)]));
      }
    }
    for (std::uint32_t j = 0; j < rows; ++j) {
      const std::uint32_t *above = &wide[std::size_t{j - (j > 0)} * columns], *row = &wide[std::size_t{j} * columns],
                          *below = &wide[std::size_t{std::min(j + 1, rows - 1)} * columns];
      for (std::uint32_t i = 0; i < columns; ++i) {
        entries_.push_back(greater_of(row[i], greater_of(above[i], below[i])));
      }
    }
    const std::uint32_t half_columns = (columns + 1) / 2, half_rows = (rows + 1) / 2;
    std::vector<std::uint32_t> halved(std::size_t{half_columns} * half_rows, 0);
    for (std::uint32_t j = 0; j < rows; ++j) {
      for (std::uint32_t i = 0; i < columns; ++i) {
        std::uint32_t& block = halved[std::size_t{j / 2} * half_columns + i / 2];
        block = greater_of(block, blocks[std::size_t{j} * columns + i]);
      }
    }
    blocks = std::move(halved);
    columns = half_columns;
    rows = half_rows;
  }
}

BoundsLevel HeightBounds::level(std::uint32_t level) const {
  const Place& place = levels_[level];
  return {entries_.data() + place.first, place.columns, place.rows};
}

}  // namespace farfeel::penetration
