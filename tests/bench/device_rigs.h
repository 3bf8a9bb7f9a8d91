// The devices of farfeel-bench device: each emulated as closely to its hardware as this machine can, with the real
// channel and driver in front of it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "master_station/devices/driver/driver.h"

namespace farfeel::bench {

/// An emulated device that is plugged in while this lives.
class DeviceRig {
 public:
  virtual ~DeviceRig() = default;
  /// Every 20 ms: the person's doing, so that a device that tells only what changes has something to tell, and one that
  /// waits to be homed or calibrated is.
  virtual void nudge(bool is_ready) = 0;
};

struct BenchedDevice {
  std::string name;     ///< of the model
  std::string channel;  ///< "libusb on an emulated usbfs node (umockdev)"
  devices::DriverFamily family;
  devices::DriverOptions options;
  std::function<std::unique_ptr<DeviceRig>()> plug_in;
  std::string lacks;  ///< empty, or why there is no such row here
};

[[nodiscard]] std::vector<BenchedDevice> benched_devices();

}  // namespace farfeel::bench
