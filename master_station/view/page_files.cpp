#include "master_station/view/page_files.h"

#include <array>

#ifdef FARFEEL_VIEW_PAGE
#include "master_station/plots/embed.h"

FARFEEL_EMBED(view_index_html, FARFEEL_VIEW_PAGE "/index.html")
FARFEEL_EMBED(view_page_js, FARFEEL_VIEW_PAGE "/page.js")
FARFEEL_EMBED(view_page_css, FARFEEL_VIEW_PAGE "/page.css")
#endif

namespace farfeel::master_station {

std::span<const PageFile> page_files() {
#ifdef FARFEEL_VIEW_PAGE
  static const std::array<PageFile, 3> files{{
      {"/", "text/html; charset=utf-8", embedded(view_index_html_begin, view_index_html_end)},
      {"/page.js", "text/javascript; charset=utf-8", embedded(view_page_js_begin, view_page_js_end)},
      {"/page.css", "text/css; charset=utf-8", embedded(view_page_css_begin, view_page_css_end)},
  }};
  return files;
#else
  return {};
#endif
}

}  // namespace farfeel::master_station
