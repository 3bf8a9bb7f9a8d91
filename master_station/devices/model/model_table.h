// A model's figures from a table of TOML. For this folder's sources: it brings the TOML library with it.
#pragma once

#include "codecs/text/checked_table.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// Throws codecs::TableFault.
[[nodiscard]] DeviceModel read_model(const codecs::CheckedTable& top, const DeviceModel& base);

}  // namespace farfeel::devices
