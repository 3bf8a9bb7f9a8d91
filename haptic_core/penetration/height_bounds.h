// What a chart's heights can do inside a square of texels, at every size: the mip pyramid that prunes a search.
#pragma once

#include <cstdint>
#include <vector>

namespace farfeel::penetration {

/// Entry (i, j) of level k speaks for texels [(i - 1) 2^k, (i + 2) 2^k) along either side: for every square that
/// reaches no farther than 2^k texels from its centre, if the centre lies in texels [i 2^k, (i + 1) 2^k). Low half: no
/// felt height there lies above this coefficient. High half: nor does the surface bend upwards by more than kBendUnit
/// times this, in coefficients a texel squared.
struct BoundsLevel {
  const std::uint32_t* entries = nullptr;
  std::uint32_t columns = 0, rows = 0;
};

inline constexpr std::uint32_t kBoundsLevels = 8;
inline constexpr double kBendUnit = 4;

/// Of one chart. Any thread may read, but for the time of an update().
class HeightBounds {
 public:
  /// Coefficient (i, j) of the 3 x 3 of texel (0, 0) stands at coefficients[j * (columns + 2) + i].
  HeightBounds(const std::uint16_t* coefficients, std::uint32_t columns, std::uint32_t rows);

  /// Texels; an end may lie beyond the chart.
  struct Part {
    std::uint32_t first_column, end_column, first_row, end_row;
  };
  /// The heights of some texels have changed. Realtime-safe; a tile's takes some tens of microseconds.
  void update(const std::uint16_t* coefficients, Part texels) noexcept;

  /// level < kBoundsLevels; the coarser ones end with a single entry.
  [[nodiscard]] BoundsLevel level(std::uint32_t level) const;

 private:
  struct Place {
    std::size_t first;
    std::uint32_t columns, rows;
  };
  std::vector<std::uint32_t> blocks_;   // of squares [i 2^k, (i + 1) 2^k)
  std::vector<std::uint32_t> entries_;  // the same, with all neighbours
  std::vector<Place> levels_;
};

}  // namespace farfeel::penetration
