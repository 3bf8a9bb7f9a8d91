// Who, where, when, and on what machine: so that a figure can be judged by a stranger.
#pragma once

#include <string>

#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

/// This machine, this user, now. `command` is what a person would type to get the same session.
[[nodiscard]] Machine this_machine(std::string command);

/// A program's arguments as a person would type them, quoted for a shell where needed.
[[nodiscard]] std::string command_line(int argc, const char* const* argv);

}  // namespace farfeel::master_station
