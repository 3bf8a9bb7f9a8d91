// A device that another process owns, as the haptic thread sees it: one load, one store.
#pragma once

#include <utility>

#include "master_station/devices/hand/sample_source.h"
#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

class LinkedDevice final : public SampleSource {
 public:
  /// The memory outlives it.
  LinkedDevice(LinkMemory& memory, DeviceModel model) : memory_(memory), model_(std::move(model)) {}

  /// What is not finite, or of no known stage, counts as a fault of the device, where it was last.
  [[nodiscard]] const Sample& newest(std::int64_t now_ns) noexcept override;
  void command(const Command& command) noexcept override { memory_.command.store(command); }
  [[nodiscard]] const DeviceModel& model() const noexcept override { return model_; }

 private:
  LinkMemory& memory_;
  DeviceModel model_;
  Sample sample_;
};

}  // namespace farfeel::devices
