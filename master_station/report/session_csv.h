// session.csv: one row a tick. The first row names the columns; every name ends in its unit or is a count, a name or
// a unit quaternion's part. An empty cell is a figure that nobody measured at that tick.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "master_station/haptic_loop/tick_record.h"
#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

/// Writes as it goes: a killed process leaves all but the newest 64 kB behind, and perhaps a row cut short at the end.
class SessionCsv {
 public:
  /// Writes every `every_nth_tick`-th tick; 1 keeps them all.
  [[nodiscard]] static tl::expected<SessionCsv, ReportError> create(const std::string& path, int every_nth_tick = 1);

  void append(const TickRecord&);
  /// Flushes and closes; an error if anything written so far did not reach the file, for instance on a full disk.
  [[nodiscard]] tl::expected<void, ReportError> close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  SessionCsv(std::string path, std::unique_ptr<std::FILE, Close> file, int every_nth_tick);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  int every_nth_tick_;
  int first_error_ = 0;  ///< errno of the first row that was not taken
  std::uint64_t seen_ = 0;
};

}  // namespace farfeel::master_station
