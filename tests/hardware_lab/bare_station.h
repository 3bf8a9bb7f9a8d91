// A station without haptics: it asks a device for a constant force while it is ready. To look at a driver alone.
#pragma once

#include <string>
#include <vector>

namespace farfeel::hardware_lab {

/// arguments: of farfeel-device serve. Runs until SIGTERM.
int run_bare_station(const std::vector<std::string>& arguments);

}  // namespace farfeel::hardware_lab
