#include "master_station/devices/driver/driver.h"

namespace farfeel::devices {

std::span<const DriverFamily> driver_families() {
  return {};
}

}  // namespace farfeel::devices
