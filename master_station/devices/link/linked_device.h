// A device that another process owns, as the haptic thread sees it: one load, one store.
#pragma once

#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

/// The haptic thread alone; realtime-safe: no allocation, no lock, no system call.
class LinkedDevice {
 public:
  /// The memory outlives it.
  explicit LinkedDevice(LinkMemory& memory) noexcept : memory_(memory) {}

  /// The newest sample. What is not finite, or of no known stage, counts as a fault of the device where it was last.
  [[nodiscard]] const Sample& newest() noexcept;
  void command(const Command& command) noexcept { memory_.command.store(command); }

 private:
  LinkMemory& memory_;
  Sample sample_;
};

}  // namespace farfeel::devices
