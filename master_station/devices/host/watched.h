// What a device says now, in words and bars, for `farfeel device watch`.
#pragma once

#include <string>

#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

struct Watched {
  std::string name;  ///< as a person chooses it: "falcon:A1B2"
  Sample sample;
  std::string advice;
  double reports_Hz = 0;
  double age_ms = 0;       ///< of the newest report
  double exchange_ms = 0;  ///< one step of the driver
};

/// Some lines, each as long in every picture, so that one drawn over another leaves nothing of it.
[[nodiscard]] std::string picture(const Watched&);
/// The same in one line, without its end.
[[nodiscard]] std::string line(const Watched&);

/// "[----###-|--------]": where in -1 to 1 it is; what is beyond counts as the end.
[[nodiscard]] std::string bar(double share);

}  // namespace farfeel::devices
