// The energy that a change of the local model may still add: what was dissipated before, up to a cap.
//
// Two-layer passivity after Franken et al., IEEE T-RO 27(4), 2011, reduced to one node: nothing may appear in the
// hand that the hand did not put in, except a stated allowance.
#pragma once

#include <algorithm>
#include <limits>

namespace farfeel::passivity {

struct TankSettings {
  double cap_J = 0.005;  ///< >= 0; what is dissipated beyond it is gone
  /// A policy, not physics: power given for nothing, so that a wall that appears under a hand at rest is felt after a
  /// while. Everything it ever gave is counted.
  double allowance_W = 0.002;
};

/// Realtime-safe.
class EnergyTank {
 public:
  explicit EnergyTank(const TankSettings& settings) : settings_(settings) {}

  /// The allowance of a tick.
  void pass(double dt_s) noexcept {
    const double given_J = std::clamp(settings_.allowance_W * dt_s, 0.0, std::max(0.0, settings_.cap_J - level_J_));
    level_J_ += given_J;
    allowed_J_ += given_J;
  }
  /// Energy that was dissipated (> 0), or given out by mistake (< 0), which makes a debt when the tank is empty.
  void add(double energy_J) noexcept { level_J_ = std::min(settings_.cap_J, level_J_ + energy_J); }
  /// Takes up to wanted_J >= 0; returns what was taken.
  double take(double wanted_J) noexcept {
    const double taken_J = std::clamp(wanted_J, 0.0, available_J());
    level_J_ -= taken_J;
    return taken_J;
  }

  [[nodiscard]] double available_J() const noexcept { return std::max(0.0, level_J_); }
  [[nodiscard]] double level_J() const noexcept { return level_J_; }      ///< negative: a debt
  [[nodiscard]] double allowed_J() const noexcept { return allowed_J_; }  ///< all the allowance ever gave

 private:
  TankSettings settings_;
  double level_J_ = 0;
  double allowed_J_ = 0;
};

}  // namespace farfeel::passivity
