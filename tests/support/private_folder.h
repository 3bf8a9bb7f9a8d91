// A fresh folder of one test's own, mode 0700, that goes with everything in it. Two users, two processes and two runs
// of a test never meet in it, as they would under a fixed name in the temporary folder.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace farfeel::test_support {

class PrivateFolder {
 public:
  PrivateFolder() : path_(testing::TempDir() + "farfeel-test-XXXXXX") {
    if (mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no folder can be made in " + testing::TempDir());
  }
  ~PrivateFolder() {
    std::error_code trouble;
    std::filesystem::remove_all(path_, trouble);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  /// Without a slash at its end.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// The path of what has that name in it; nothing is made.
  [[nodiscard]] std::string operator/(std::string_view name) const { return path_ + "/" + std::string(name); }

 private:
  std::string path_;
};

}  // namespace farfeel::test_support
