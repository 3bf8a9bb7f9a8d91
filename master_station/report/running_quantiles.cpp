#include "master_station/report/running_quantiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::master_station {
namespace {

constexpr double kSmallest = 1e-3;
constexpr double kLargest = 1e9;
const double kLogGrowth = std::log(1.01);

}  // namespace

void RunningQuantiles::add(double value) {
  if (!std::isfinite(value)) return;
  max_ = count_ == 0 ? value : std::max(max_, value);
  ++count_;
  const double in_range = std::clamp(value, kSmallest, kLargest);
  const auto bin = static_cast<std::size_t>(std::log(in_range / kSmallest) / kLogGrowth);
  ++bins_[std::min(bin, kBins - 1)];
}

double RunningQuantiles::quantile(double share) const {
  if (count_ == 0) return std::numeric_limits<double>::quiet_NaN();
  const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    below += bins_[bin];
    // The bin's geometric middle is within half a per cent of everything in it; no quantile exceeds the maximum.
    if (below >= std::max<std::uint64_t>(rank, 1))
      return std::min(kSmallest * std::exp((static_cast<double>(bin) + 0.5) * kLogGrowth), max_);
  }
  return max_;
}

double RunningQuantiles::max() const {
  return count_ == 0 ? std::numeric_limits<double>::quiet_NaN() : max_;
}

}  // namespace farfeel::master_station
