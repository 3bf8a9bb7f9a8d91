// Quantiles of a stream in a fixed amount of memory: a histogram whose bins grow by 1 %.
#pragma once

#include <array>
#include <cstdint>

namespace farfeel::master_station {

/// For positive quantities of any unit between 1e-3 and 1e9; what is smaller counts as 1e-3, what is larger as 1e9.
/// A quantile is within 1 % of the sample's own; count, max and mean are exact. NaN and infinities are not counted.
class RunningQuantiles {
 public:
  void add(double value);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double quantile(double share) const;  ///< share in [0, 1]; NaN when nothing was added
  [[nodiscard]] double max() const;                   ///< NaN when nothing was added

 private:
  static constexpr std::size_t kBins = 2778;  ///< ln(1e12) / ln(1.01), and one
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double max_ = 0;
};

}  // namespace farfeel::master_station
