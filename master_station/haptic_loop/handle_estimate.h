// Where the handle is, between the counts of its encoders.
//
// A handle at rest on the border between two counts is read as one or the other in turn, and a stiff coupling makes a
// force of that: a limit cycle of one count. All that a reading says is that the handle is within half a step of it. So
// the estimate goes on as it went, gives way to a reading no further than that, in a fraction of a millisecond, and
// comes to it slowly.
#pragma once

#include "haptic_core/spatial/spatial.h"
#include "master_station/devices/device.h"

namespace farfeel::master_station {

/// Realtime-safe.
class HandleEstimate {
 public:
  explicit HandleEstimate(const DeviceCapabilities& device)
      : step_m_(device.position_step_m), step_rad_(device.rotation_step_rad) {}

  /// The handle in the device's base frame, from the newest reading of it and the one dt_s ago: never further than a
  /// step from the reading, along and about any axis, and half a step soon. The first is the reading itself.
  [[nodiscard]] const spatial::Pose& next(const spatial::Pose& X_BD_read, double dt_s) noexcept;
  /// What was known is not true any more.
  void forget() noexcept { is_known_ = false; }

 private:
  double step_m_, step_rad_;
  bool is_known_ = false;
  spatial::Pose X_BD_;
  glm::dvec3 v_BD_m_s_{0};  // between counts
};

}  // namespace farfeel::master_station
