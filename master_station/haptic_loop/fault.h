// Why the force is off, and what the loop is doing, for programs and for persons.
#pragma once

#include <cstdint>
#include <string_view>

#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::master_station {

/// Why the force went off. Latched until a person resets it.
enum class Fault : std::uint8_t {
  kNone,
  kContactsNotUsable,  ///< not finite, or not of a sane size
  kDeviceNotFinite,
  kDeviceTooFast,
  kDeviceSilent,
  kDeviceGivesWork,
  kDeviceGoesElsewhere,
  kToolNotFinite,
  kContactLost  ///< one that pressed deep was gone from one answer to the next
};
/// What happened and what to do, for a person.
[[nodiscard]] std::string_view message(Fault) noexcept;
[[nodiscard]] std::string_view message(LoopState) noexcept;

}  // namespace farfeel::master_station
