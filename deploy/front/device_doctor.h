// The part of `farfeel doctor` that looks at haptic devices: what is plugged in, and what stands in its way.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "deploy/front/doctor.h"

namespace farfeel::front {

/// Where /sys, /proc, /dev and /etc are, so that a test can have its own.
struct MachineRoot {
  std::string folder;  ///< empty: this machine
  /// Whether this person may read and write a file, by its path below `folder`.
  std::function<bool(const std::string& path)> may_open;
};

[[nodiscard]] MachineRoot this_machine_root();

/// One finding about the rules, and one for each thing about each device: permission, driver, who else has it open,
/// USB autosuspend.
[[nodiscard]] std::vector<Finding> examine_devices(const MachineRoot&);

}  // namespace farfeel::front
