#include "master_station/devices/link/linked_device.h"

namespace farfeel::devices {

const Sample& LinkedDevice::newest() noexcept {
  Sample sample;
  if (!memory_.sample.load(sample)) return sample_;
  const bool is_sane = static_cast<std::size_t>(sample.stage) < kStages && spatial::is_valid(sample.X_BD) &&
                       spatial::is_finite(sample.V_BD_B) && spatial::is_finite(sample.deflection.turn) &&
                       spatial::is_finite(sample.deflection.push);
  if (is_sane) {
    sample_ = sample;
  } else {
    sample_.stage = Stage::kFault;
  }
  return sample_;
}

}  // namespace farfeel::devices
