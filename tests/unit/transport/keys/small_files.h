// Small files of keys, as an editor and a person would handle them, in a folder of the test's own.
#pragma once

#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "tests/support/private_folder.h"

namespace farfeel::transport {

using test_support::PrivateFolder;

// In place, as an editor might; mode 0600 where it is new.
inline void put(const std::string& path, std::string_view text) {
  std::ofstream(path, std::ios::binary) << text;
  chmod(path.c_str(), 0600);
}

inline std::string got(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline int mode_of(const std::string& path) {
  struct stat s {};
  return stat(path.c_str(), &s) == 0 ? static_cast<int>(s.st_mode & 07777) : -1;
}

}  // namespace farfeel::transport
