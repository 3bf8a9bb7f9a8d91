// The figures of the link benches: quantiles of a block, and medians of blocks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace farfeel::bench {

/// The smallest sample that at least a share q of all does not exceed (nearest rank), 0 < q <= 1. NaN without samples.
[[nodiscard]] inline double quantile(std::vector<double> samples, double q) {
  if (samples.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double rank = std::ceil(q * static_cast<double>(samples.size()) - 1e-9);
  const auto at = static_cast<std::size_t>(std::max(1.0, rank)) - 1;
  std::nth_element(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(at), samples.end());
  return samples[at];
}

struct Quantiles {
  double p50 = std::numeric_limits<double>::quiet_NaN(), p99 = p50, p99_9 = p50;
};

[[nodiscard]] inline Quantiles quantiles(const std::vector<double>& samples) {
  return {quantile(samples, 0.5), quantile(samples, 0.99), quantile(samples, 0.999)};
}

/// Each quantile's median over the rounds: of an even number the lower one.
[[nodiscard]] inline Quantiles medians(const std::vector<Quantiles>& rounds) {
  const auto median = [&](double Quantiles::*which) {
    std::vector<double> values;
    for (const Quantiles& round : rounds)
      if (!std::isnan(round.*which)) values.push_back(round.*which);
    return quantile(std::move(values), 0.5);
  };
  return {median(&Quantiles::p50), median(&Quantiles::p99), median(&Quantiles::p99_9)};
}

}  // namespace farfeel::bench
