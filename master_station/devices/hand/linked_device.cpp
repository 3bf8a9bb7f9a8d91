#include "master_station/devices/hand/linked_device.h"

namespace farfeel::devices {

const Sample& LinkedDevice::newest(std::int64_t /*now_ns*/) noexcept {
  Sample sample;
  if (!memory_.sample.load(sample)) return sample_;
  if (static_cast<std::size_t>(sample.stage) < kStages && is_usable(sample)) {
    sample_ = sample;
  } else {
    sample_.stage = Stage::kFault;
  }
  return sample_;
}

}  // namespace farfeel::devices
