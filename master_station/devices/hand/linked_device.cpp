#include "master_station/devices/hand/linked_device.h"

namespace farfeel::devices {

const Sample& LinkedDevice::newest(std::int64_t /*now_ns*/) noexcept {
  Sample sample;
  if (!memory_.sample.load(sample)) return sample_;
  if (static_cast<std::size_t>(sample.stage) < kStages && is_usable(sample)) {
    sample_ = calibrated(device_.calibration, sample);
  } else {
    sample_.stage = Stage::kFault;
  }
  return sample_;
}

void LinkedDevice::command(const Command& command_B) noexcept {
  Command command = command_B;
  command.F_hand_B = for_device(device_.calibration, command_B.F_hand_B);
  memory_.command.store(command);
}

}  // namespace farfeel::devices
