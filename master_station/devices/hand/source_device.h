// One opened device as a Device, in its own base and as it is: what a guard is put around.
#pragma once

#include <atomic>

#include "master_station/devices/device.h"
#include "master_station/devices/hand/sample_source.h"

namespace farfeel::devices {

class SourceDevice final : public master_station::Device {
 public:
  /// The source outlives it. capabilities: of its model, as the coupling's rule has them.
  SourceDevice(SampleSource& source, const master_station::DeviceCapabilities& capabilities) noexcept
      : source_(source), capabilities_(capabilities) {}

  // Realtime-safe, one thread.
  [[nodiscard]] const master_station::DeviceCapabilities& capabilities() const noexcept override {
    return capabilities_;
  }
  /// is_live: it is set up and was heard within kStaleSample_ns. What is not finite is passed on as such.
  [[nodiscard]] master_station::DeviceState read(std::int64_t time_ns) noexcept override;
  /// Force is off while the device is not live, and for a wrench that is not finite.
  void write(const spatial::Wrench& F_hand_B) noexcept override;

  /// As read last.
  [[nodiscard]] const Sample& sample() const noexcept { return *sample_; }
  [[nodiscard]] const DeviceModel& model() const noexcept { return source_.model(); }
  /// The next reading tells that the handle is mapped otherwise from then on.
  void map_anew() noexcept { ++mapping_; }

  /// Any thread. For a device without a button: the clutch, held by a key or a foot switch.
  void hold_clutch(bool is_held) noexcept { is_station_clutch_held_.store(is_held, std::memory_order_relaxed); }

 private:
  SampleSource& source_;
  master_station::DeviceCapabilities capabilities_;
  const Sample none_{};
  const Sample* sample_ = &none_;
  std::int64_t time_ns_ = 0;
  bool is_live_ = false;
  std::uint32_t mapping_ = 0;
  std::atomic<bool> is_station_clutch_held_{false};
};

}  // namespace farfeel::devices
