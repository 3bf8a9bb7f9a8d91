// What a procedure's force becomes for the device: only while the person holds, only up to a cap, only with fresh
// readings.
#pragma once

#include <cstdint>

#include "master_station/devices/guard/deadman.h"
#include "master_station/devices/link/sample.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// One thread; pure.
class HeldForce {
 public:
  HeldForce(const DeviceModel& model, double cap_N) : model_(model), cap_N_(cap_N) {}

  /// Once a tick, before the procedure: whether force may act now. The grip button has to be held, from an edge on; of
  /// a device that has none, the key.
  [[nodiscard]] bool next(std::int64_t now_ns, const Sample&, bool is_key_held) noexcept;
  /// After it: zero where force may not act, or is not finite; else no longer than the cap.
  [[nodiscard]] Command command(std::int64_t now_ns, const glm::dvec3& force_N) const noexcept;

 private:
  DeviceModel model_;
  double cap_N_;
  Deadman deadman_{Enabling::kHold};
  std::uint32_t opening_ = 0;
};

}  // namespace farfeel::devices
