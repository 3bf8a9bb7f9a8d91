// The part of `farfeel doctor` that looks at what lets a loop of 1 kHz run on time: the processors' clocks, whom they
// are shared with, and what the kernel lets a real-time thread take.
#pragma once

#include <vector>

#include "deploy/front/device_doctor.h"

namespace farfeel::front {

/// One finding each: clock governor, isolated cores, the real-time throttle. None is ever missing.
[[nodiscard]] std::vector<Finding> examine_loop(const MachineRoot&);

}  // namespace farfeel::front
