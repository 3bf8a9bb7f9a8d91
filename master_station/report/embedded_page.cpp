#include "master_station/report/embedded_page.h"

#define EMBED(name, file)                                                                                \
  asm(".section .rodata\n" #name "_begin:\n.incbin \"" file "\"\n" #name "_end:\n.byte 0\n.previous\n"); \
  extern "C" const char name##_begin[], name##_end[];
EMBED(report_page_style, FARFEEL_REPORT_STYLE)
#ifdef FARFEEL_REPORT_SCRIPT
EMBED(report_page_script, FARFEEL_REPORT_SCRIPT)
#endif

namespace farfeel::master_station {
namespace {

std::string_view text(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace

std::string_view report_style() {
  return text(report_page_style_begin, report_page_style_end);
}

std::string_view report_script() {
#ifdef FARFEEL_REPORT_SCRIPT
  return text(report_page_script_begin, report_page_script_end);
#else
  return {};
#endif
}

}  // namespace farfeel::master_station
