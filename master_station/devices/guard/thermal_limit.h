// How much force a motor's heat leaves: heat follows the square of force with a time constant,
//
//   tau dq/dt = F^2 - q,
//
// and from 0.8 of the continuous force's heat on, the limit falls in proportion from the greatest to the continuous
// force, which it reaches where that would be held for ever.
#pragma once

#include <algorithm>

namespace farfeel::devices {

/// Realtime-safe.
class ThermalLimit {
 public:
  /// time_s = 0: nothing is known of its heat, the limit is max_N for ever.
  ThermalLimit(double max_N, double continuous_N, double time_s) noexcept
      : max_N_(max_N), continuous_N_(std::min(continuous_N, max_N)), time_s_(time_s) {}

  /// After force_N was on for dt_s.
  void advance(double force_N, double dt_s) noexcept {
    if (time_s_ > 0) heat_N2_ += std::min(1.0, dt_s / time_s_) * (force_N * force_N - heat_N2_);
  }
  [[nodiscard]] double limit_N() const noexcept {
    if (time_s_ <= 0) return max_N_;
    const double full_N2 = continuous_N_ * continuous_N_;
    const double left = std::clamp((full_N2 - heat_N2_) / (kFalls * full_N2 + 1e-12), 0.0, 1.0);
    return continuous_N_ + left * (max_N_ - continuous_N_);
  }

 private:
  static constexpr double kFalls = 0.2;
  double max_N_, continuous_N_, time_s_;
  double heat_N2_ = 0;
};

}  // namespace farfeel::devices
