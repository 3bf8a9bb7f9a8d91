// What a station says as it runs, on standard error.
#pragma once

#include <string>

namespace farfeel::codecs {

/// Lines of spdlog's default logger begin with the time and this name; coloured on a terminal, unless NO_COLOR is set.
void log_as(const std::string& name);

}  // namespace farfeel::codecs
