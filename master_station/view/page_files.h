// The page's files, as the build embedded them; all empty where it had no npm packages to bundle them from.
#pragma once

#include <span>
#include <string_view>

namespace farfeel::master_station {

struct PageFile {
  std::string_view path, type, bytes;
};
/// As asked for in HTTP, with its media type.
[[nodiscard]] std::span<const PageFile> page_files();
/// Whether there is a page in this build.
[[nodiscard]] inline bool has_page() {
  return !page_files().empty();
}

}  // namespace farfeel::master_station
