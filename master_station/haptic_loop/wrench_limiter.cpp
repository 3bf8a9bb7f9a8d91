#include "master_station/haptic_loop/wrench_limiter.h"

#include <algorithm>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::master_station {
namespace {

using spatial::no_longer_than;

/// After a fault the gain comes back slowly.
constexpr double kRestore_s = 0.2;

}  // namespace

WrenchLimiter::WrenchLimiter(const DeviceCapabilities& device)
    : max_force_N_(device.force_dof > 0 ? device.max_force_N : 0),
      max_torque_Nm_(device.torque_dof > 0 ? device.max_torque_Nm : 0),
      max_force_rate_N_per_s_(device.max_force_rate_N_per_s),
      // Full torque takes as long as full force.
      max_torque_rate_Nm_per_s_(max_force_N_ > 0 ? device.max_force_rate_N_per_s * max_torque_Nm_ / max_force_N_ : 0),
      max_power_W_(device.max_power_W) {}

void WrenchLimiter::ramp_down(double ramp_s) noexcept {
  gain_rate_1_per_s_ = -1 / ramp_s;
}

void WrenchLimiter::restore() noexcept {
  gain_rate_1_per_s_ = 1 / kRestore_s;
}

spatial::Wrench WrenchLimiter::limited(const spatial::Wrench& wanted, const spatial::Twist& V, double dt_s,
                                       bool is_returning) noexcept {
  gain_ = std::clamp(gain_ + gain_rate_1_per_s_ * dt_s, 0.0, 1.0);
  spatial::Wrench F = spatial::is_finite(wanted) ? wanted : last_;
  F = {gain_ * no_longer_than(max_torque_Nm_, F.torque_Nm), gain_ * no_longer_than(max_force_N_, F.force_N)};
  F = {last_.torque_Nm + no_longer_than(max_torque_rate_Nm_per_s_ * dt_s, F.torque_Nm - last_.torque_Nm),
       last_.force_N + no_longer_than(max_force_rate_N_per_s_ * dt_s, F.force_N - last_.force_N)};
  if (is_returning) {
    const double share = kReturn_N_per_s * dt_s / std::max(max_force_N_, 1e-12);  // full torque takes as long
    F = {no_longer_than(glm::length(last_.torque_Nm) + share * max_torque_Nm_, F.torque_Nm),
         no_longer_than(glm::length(last_.force_N) + share * max_force_N_, F.force_N)};
  }
  // Only power that drives the hand is limited: braking it may take what it takes.
  const double power = spatial::power_W(F, V);
  if (power > max_power_W_) F = max_power_W_ / power * F;
  last_ = F;
  return F;
}

}  // namespace farfeel::master_station
