// A fresh folder, mode 0700, that goes when the test ends.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

namespace farfeel::transport {

class PrivateFolder {
 public:
  PrivateFolder() {
    std::string pattern = testing::TempDir() + "/farfeel-keys-XXXXXX";
    path_ = mkdtemp(pattern.data());
  }
  ~PrivateFolder() {
    std::error_code trouble;
    std::filesystem::remove_all(path_, trouble);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string operator/(std::string_view name) const { return path_ + "/" + std::string(name); }

 private:
  std::string path_;
};

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
