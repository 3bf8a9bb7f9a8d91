// What a tick costs where the tool touches seven times at once.
#pragma once

#include <cstdint>

namespace farfeel::bench {

struct TickTimes {
  std::uint32_t contacts = 0;  ///< felt from tiles in the last tick
  double p50_us = 0, p99_us = 0, p99_9_us = 0;
};
/// Seven ridged tables in one place under one curved plate, each contact a window of 64 x 64 texels.
[[nodiscard]] TickTimes time_seven_contacts(int ticks);

}  // namespace farfeel::bench
