#include "master_station/view/page_files.h"

#include <array>

#ifdef FARFEEL_VIEW_PAGE
#define EMBED(name, file)                                                                      \
  asm(".section .rodata\n" #name "_begin:\n.incbin \"" FARFEEL_VIEW_PAGE "/" file "\"\n" #name \
      "_end:\n.byte 0\n.previous\n");                                                          \
  extern "C" const char name##_begin[], name##_end[];
EMBED(view_index_html, "index.html")
EMBED(view_page_js, "page.js")
EMBED(view_page_css, "page.css")
#endif

namespace farfeel::master_station {

std::span<const PageFile> page_files() {
#ifdef FARFEEL_VIEW_PAGE
  const auto text = [](const char* begin, const char* end) {
    return std::string_view(begin, static_cast<std::size_t>(end - begin));
  };
  static const std::array<PageFile, 3> files{{
      {"/", "text/html; charset=utf-8", text(view_index_html_begin, view_index_html_end)},
      {"/page.js", "text/javascript; charset=utf-8", text(view_page_js_begin, view_page_js_end)},
      {"/page.css", "text/css; charset=utf-8", text(view_page_css_begin, view_page_css_end)},
  }};
  return files;
#else
  return {};
#endif
}

}  // namespace farfeel::master_station
