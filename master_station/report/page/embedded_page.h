// The report page's own parts, put into the program when it is built.
#pragma once

#include <string_view>

namespace farfeel::master_station {

extern const std::string_view kPlotLibraryScript;  ///< dygraphs, MIT, from Debian's libjs-dygraphs
extern const std::string_view kPlotLibraryStyle;
extern const std::string_view kPageScript;
extern const std::string_view kPageStyle;

}  // namespace farfeel::master_station
