// The folder that one run's files lie in. No two runs write into the same one at once, and unless a folder is named
// each run has a new one.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

inline constexpr const char* kLatestRun = "latest";

class RunFolder {
 public:
  /// That very folder, made if it is not there, and locked while this object lives. The error says what is in the way.
  [[nodiscard]] static tl::expected<RunFolder, ReportError> take(const std::string& path);
  /// A new one below `above`, named after the time. It goes with this object if nothing was put in it.
  [[nodiscard]] static tl::expected<RunFolder, ReportError> make_new(const std::string& above);
  /// That folder where one is named, else a new one.
  [[nodiscard]] static tl::expected<RunFolder, ReportError> of(const std::string& named, const std::string& above);

  RunFolder(RunFolder&& other) noexcept
      : path_(std::move(other.path_)), above_(std::move(other.above_)), lock_(std::exchange(other.lock_, -1)) {}
  RunFolder& operator=(RunFolder&&) = delete;
  ~RunFolder();

  /// Now that everything else is right: takes away what an older run left in a folder that was named again, whose
  /// report must not pass for this run's, and points above/latest to a new one.
  void begin() const;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  RunFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}
  std::string path_, above_;  ///< above_: of a new one alone
  int lock_;
};

}  // namespace farfeel::master_station
