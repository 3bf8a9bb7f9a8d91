// Which devices a person has felt, by serial number and calibration: the first force of any other begins softly. Files
// in the state folder, read and written outside the haptic tick.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "master_station/devices/model/device_file.h"

namespace farfeel::devices {

/// $XDG_STATE_HOME/farfeel/devices, or ~/.local/state/farfeel/devices.
[[nodiscard]] tl::expected<std::string, ModelError> known_devices_folder();

/// False for a serial number that was not remembered, or was with another calibration or other figures; and where the
/// folder cannot be read, for then the soft beginning is the safe one.
[[nodiscard]] bool is_known_device(const std::string& folder, std::string_view serial, const DeviceFile&);
[[nodiscard]] tl::expected<void, ModelError> remember_device(const std::string& folder, std::string_view serial,
                                                             const DeviceFile&);

}  // namespace farfeel::devices
