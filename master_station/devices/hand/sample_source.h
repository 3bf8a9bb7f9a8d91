// One opened device, as the haptic thread sees it: its newest sample, its next command, and what is known of its model.
#pragma once

#include <cstdint>

#include "master_station/devices/link/sample.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// Used by the haptic thread alone, from inside a tick: newest() is one load and command() one store, without
/// allocation, lock, system call or exception.
class SampleSource {
 public:
  virtual ~SampleSource() = default;

  /// The newest that is known at now_ns (CLOCK_MONOTONIC). The reference holds until the next call.
  [[nodiscard]] virtual const Sample& newest(std::int64_t now_ns) noexcept = 0;
  virtual void command(const Command&) noexcept = 0;
  [[nodiscard]] virtual const DeviceModel& model() const noexcept = 0;
};

/// How old the newest word of the device is: of one that streams, its newest report; of one that tells only what
/// changes, the owner's last good poll, because its silence means the last report. Never heard: the greatest number.
[[nodiscard]] std::int64_t silence_ns(const Sample&, Reports, std::int64_t now_ns) noexcept;

/// Its readings can be used: it is set up, without fault, and silent for less than kStaleSample_ns.
[[nodiscard]] bool is_heard(const Sample&, Reports, std::int64_t now_ns) noexcept;

/// Pose, twist and deflection are finite, and the pose's quaternion has length 1.
[[nodiscard]] bool is_usable(const Sample&) noexcept;

}  // namespace farfeel::devices
