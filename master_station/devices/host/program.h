// The program farfeel-device, for whatever hardware it was built with; a test's program has hardware of its own.
#pragma once

#include <span>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/host/found_list.h"

namespace farfeel::devices {

/// main(): takes the command line apart and runs the command. Returns the exit status.
[[nodiscard]] int run_program(int argc, char** argv, std::span<const DriverFamily> families, ModelLookup lookup);

}  // namespace farfeel::devices
