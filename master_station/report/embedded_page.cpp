#include "master_station/report/embedded_page.h"

#include "master_station/plots/embed.h"

FARFEEL_EMBED(report_page_style, FARFEEL_REPORT_STYLE)
#ifdef FARFEEL_REPORT_SCRIPT
FARFEEL_EMBED(report_page_script, FARFEEL_REPORT_SCRIPT)
#endif

namespace farfeel::master_station {

std::string_view report_style() {
  return embedded(report_page_style_begin, report_page_style_end);
}

std::string_view report_script() {
#ifdef FARFEEL_REPORT_SCRIPT
  return embedded(report_page_script_begin, report_page_script_end);
#else
  return {};
#endif
}

}  // namespace farfeel::master_station
