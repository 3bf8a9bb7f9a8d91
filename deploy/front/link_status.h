// `farfeel link-status`: what is known of the links of the stations that run on this machine.
#pragma once

#include <string>

#include "transport/status/link_status.h"

namespace farfeel::front {

/// Some lines for a person.
[[nodiscard]] std::string told(const transport::LinkStatus&);

/// argv[0] is "link-status". Returns the exit status: 0 told, 1 no station runs here, another where the words make no
/// sense.
[[nodiscard]] int link_status_command(int argc, char** argv);

}  // namespace farfeel::front
