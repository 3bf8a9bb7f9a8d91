// Labels beside the ends of a plot's lines.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

namespace farfeel::bench {

constexpr double kLabelApart_px = 14;  // of letters 12 px high

/// Where labels go that belong at these heights [px]: in the same order, and none over another.
template <std::size_t N>
[[nodiscard]] std::array<double, N> label_heights_px(std::array<double, N> y_px) {
  std::array<std::size_t, N> order{};
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return y_px[a] < y_px[b]; });
  for (std::size_t i = 1; i < N; ++i) y_px[order[i]] = std::max(y_px[order[i]], y_px[order[i - 1]] + kLabelApart_px);
  return y_px;
}

}  // namespace farfeel::bench
