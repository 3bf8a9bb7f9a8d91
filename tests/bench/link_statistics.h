// The figures of the link benches: quantiles of a block, and medians of blocks.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/quantile.h"

namespace farfeel::bench {

using support::quantile;

struct Quantiles {
  double p50 = std::numeric_limits<double>::quiet_NaN(), p99 = p50, p99_9 = p50;
};

[[nodiscard]] inline Quantiles quantiles(const std::vector<double>& samples) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  return {quantile(samples, 0.5, none), quantile(samples, 0.99, none), quantile(samples, 0.999, none)};
}

/// Each quantile's median over the rounds: of an even number the lower one.
[[nodiscard]] inline Quantiles medians(const std::vector<Quantiles>& rounds) {
  const auto median = [&](double Quantiles::*which) {
    std::vector<double> values;
    for (const Quantiles& round : rounds)
      if (!std::isnan(round.*which)) values.push_back(round.*which);
    return quantile(std::move(values), 0.5, std::numeric_limits<double>::quiet_NaN());
  };
  return {median(&Quantiles::p50), median(&Quantiles::p99), median(&Quantiles::p99_9)};
}

}  // namespace farfeel::bench
