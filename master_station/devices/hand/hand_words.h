// The mapping in plain words, for start-up: what moves what, how far, and what is not felt.
#pragma once

#include <string>
#include <vector>

#include "master_station/devices/hand/hand.h"
#include "master_station/haptic_loop/handle_gear.h"

namespace farfeel::devices {

/// One sentence a line. second and view may be null. Buttons count from 1.
[[nodiscard]] std::vector<std::string> mapping_in_words(const DeviceModel& primary, const DeviceModel* second,
                                                        const DeviceModel* view, const HandSettings&,
                                                        const master_station::GearScales&);

}  // namespace farfeel::devices
