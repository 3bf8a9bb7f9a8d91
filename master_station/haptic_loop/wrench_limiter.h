// The last gate before the hand: magnitude, rate of change and power of a wrench, and a gain that can be ramped down.
#pragma once

#include "haptic_core/spatial/spatial.h"
#include "master_station/devices/device.h"

namespace farfeel::master_station {

/// Realtime-safe.
class WrenchLimiter {
 public:
  explicit WrenchLimiter(const DeviceCapabilities&);

  /// The wrench nearest to `wanted` that the limits allow one tick after the last. V is the handle's twist. What is
  /// not finite counts as the last wrench. is_returning: force comes again after a silence of the remote, and rises by
  /// at most kReturn_N_per_s.
  [[nodiscard]] spatial::Wrench limited(const spatial::Wrench& wanted, const spatial::Twist& V, double dt_s,
                                        bool is_returning = false) noexcept;

  static constexpr double kReturn_N_per_s = 200;

  /// From now on the wrench goes to zero within ramp_s and stays there, until restore().
  void ramp_down(double ramp_s) noexcept;
  void restore() noexcept;
  [[nodiscard]] bool is_ramping() const noexcept { return gain_ < 1; }
  [[nodiscard]] bool is_off() const noexcept { return gain_ == 0; }

 private:
  double max_force_N_, max_torque_Nm_, max_force_rate_N_per_s_, max_torque_rate_Nm_per_s_, max_power_W_;
  double gain_ = 1, gain_rate_1_per_s_ = 0;
  spatial::Wrench last_;
};

}  // namespace farfeel::master_station
