// What a person does with devices, one function and one file a command. Each returns the program's exit status.
//
// All open hardware by the Owner alone, with its keeper, as a session does.
#pragma once

#include <span>
#include <string>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/host/found_list.h"
#include "master_station/devices/host/owner.h"

namespace farfeel::devices {

/// What there is to choose from, and what a person chose.
struct Hardware {
  std::span<const DriverFamily> families;
  ModelLookup lookup;
  DriverOptions options;
  std::string device = "auto";  ///< NAME[:SERIAL]
};

enum class ListForm { kForPerson, kJson, kForStation };

/// farfeel device list
[[nodiscard]] int list(const Hardware&, ListForm);

/// farfeel device watch: live in a terminal, a line a second elsewhere, until Ctrl-C. Force stays off.
[[nodiscard]] int watch(const Hardware&);

/// farfeel device test: asks whether the device tells and pushes where it should. has_consent: to weak forces.
[[nodiscard]] int test(const Hardware&, bool has_consent);

/// farfeel device calibrate: writes the device's own file.
[[nodiscard]] int calibrate(const Hardware&);

/// farfeel device identify-limits: searches the stiffest calm coupling; writes the device's own file.
[[nodiscard]] int identify_limits(const Hardware&, bool has_consent);

}  // namespace farfeel::devices
