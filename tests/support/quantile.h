// The quantile of a sample, as every benchmark tells it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace farfeel::support {

/// The smallest of the values that at least a share of all, 0 < share <= 1, does not exceed (nearest rank): always one
/// of them. of_none: what there is without values.
template <class Number>
[[nodiscard]] double quantile(std::vector<Number> values, double share, double of_none = 0) {
  if (values.empty()) return of_none;
  const double rank = std::ceil(share * static_cast<double>(values.size()) - 1e-9);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max(1.0, rank)) - 1;
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

}  // namespace farfeel::support
