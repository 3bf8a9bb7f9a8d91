// A device that another process owns, as the haptic thread sees it: one load, one store, in its base frame B.
#pragma once

#include <utility>

#include "master_station/devices/hand/sample_source.h"
#include "master_station/devices/link/link_memory.h"
#include "master_station/devices/model/device_file.h"

namespace farfeel::devices {

class LinkedDevice final : public SampleSource {
 public:
  /// The memory outlives it. device: the model's figures, and what calibration says of this one's axes and newtons.
  LinkedDevice(LinkMemory& memory, DeviceFile device) : memory_(memory), device_(std::move(device)) {}

  /// What is not finite, or of no known stage, counts as a fault of the device, where it was last.
  [[nodiscard]] const Sample& newest(std::int64_t now_ns) noexcept override;
  void command(const Command&) noexcept override;
  [[nodiscard]] const DeviceModel& model() const noexcept override { return device_.model; }

 private:
  LinkMemory& memory_;
  DeviceFile device_;
  Sample sample_;
};

}  // namespace farfeel::devices
