// session.csv: one row a tick. The first row names the columns; every name ends in its unit or is a count, a name or
// a unit quaternion's part. An empty cell is a figure that nobody measured at that tick.
//
// Of a long session not every tick is kept: each of the first kWhole, then every 2nd up to twice as many, every 4th up
// to four times, and so on: 8 h at 1 kHz are some 120 MB, not 10 GB. Ticks at which the state changes are kept, and all
// within kAround of one at which a fault begins. Rows stand in the order of their times.
#pragma once

#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "master_station/haptic_loop/tick_record.h"
#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

/// Writes as it goes: a killed process leaves all but the newest 64 kB behind, and where ticks are left out but the
/// newest kAround; and perhaps a row cut short at the end.
class SessionCsv {
 public:
  static constexpr std::uint64_t kWhole = 60'000;  ///< ticks: a minute at 1 kHz
  static constexpr std::uint64_t kAround = 1'000;  ///< ticks on either side of a fault's beginning
  static constexpr int kThinsItself = 0;
  /// Writes every `every_nth_tick`-th tick, 1 all of them, and those that are kept anyway.
  [[nodiscard]] static tl::expected<SessionCsv, ReportError> create(const std::string& path,
                                                                    int every_nth_tick = kThinsItself);

  void append(const TickRecord&);
  /// Flushes and closes; an error if anything written so far did not reach the file, for instance on a full disk.
  [[nodiscard]] tl::expected<void, ReportError> close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct Waiting {
    bool is_kept;
    TickRecord tick;
  };
  SessionCsv(std::string path, std::unique_ptr<std::FILE, Close> file, int every_nth_tick);
  void write_until(std::size_t waiting);
  void write(const TickRecord&);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  int every_nth_tick_;
  int first_error_ = 0;  ///< errno of the first row that was not taken
  std::uint64_t seen_ = 0;
  std::uint64_t whole_until_ = 0;  ///< ticks seen
  LoopState state_ = LoopState::kFree;
  std::deque<Waiting> waiting_;  ///< begins with one that is not kept yet, kAround at most: a fault may come
};

}  // namespace farfeel::master_station
