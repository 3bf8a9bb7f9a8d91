#include <array>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/driver/falcon_driver.h"
#include "master_station/devices/driver/inverse3_driver.h"
#include "master_station/devices/driver/pid_joystick_driver.h"
#include "master_station/devices/driver/plug_in_driver.h"
#include "master_station/devices/driver/space_mouse_driver.h"
#include "master_station/devices/driver/wooden_haptics_driver.h"

namespace farfeel::devices {

std::span<const DriverFamily> driver_families() {
  static const std::array kFamilies{kPlugInFamily,   kFalconFamily,      kWoodenHapticsFamily,
                                    kInverse3Family, kPidJoystickFamily, kSpaceMouseFamily};
  return kFamilies;
}

}  // namespace farfeel::devices
