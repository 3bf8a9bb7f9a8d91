// The report page's own parts, put into the program when it is built.
#pragma once

#include <string_view>

namespace farfeel::master_station {

/// With uPlot, MIT; empty where the build had no npm packages to bundle it from.
[[nodiscard]] std::string_view report_script();
[[nodiscard]] std::string_view report_style();

}  // namespace farfeel::master_station
