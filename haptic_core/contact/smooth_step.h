// How shares of contacts fade: from nothing to all without a kink, so that no force has one.
#pragma once

#include <algorithm>

namespace farfeel::contact {

/// x^2 (3 - 2 x): 0 up to x = 0, 1 from x = 1 on, with slope 0 at both.
[[nodiscard]] inline double smooth_step(double x) noexcept {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

/// Its derivative, for x in [0, 1].
[[nodiscard]] inline double smooth_step_slope(double x) noexcept {
  return 6 * x * (1 - x);
}

/// 0 where x is at `none`, 1 where it is at `all`, which may be the lesser of the two.
[[nodiscard]] inline double share_between(double x, double none, double all) noexcept {
  return smooth_step((x - none) / (all - none));
}

}  // namespace farfeel::contact
