// session.csv, read back for plots: every quantity as its least and greatest value in buckets of ticks, so that no peak
// is lost however long the session was and the memory needed does not grow with it.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

inline constexpr std::size_t kMaxTraceBuckets = 16'000;  ///< a plot is some 1,000 pixels wide: fine for a deep zoom

/// One plotted quantity. An empty bucket is NaN in both.
struct TraceLine {
  std::string name;  ///< as in session.csv, or the length of a vector there: hand_force_N, hand_torque_Nm
  std::vector<float> low, high;
};

struct SessionTrace {
  std::uint64_t rows = 0;             ///< read from the file
  std::uint64_t rows_per_bucket = 1;  ///< a power of two; the last bucket may hold fewer
  std::vector<float> time_s;          ///< of the first row in each bucket
  std::vector<std::uint8_t> state;    ///< LoopState, the gravest in each bucket
  std::vector<TraceLine> lines;       ///< all as long as time_s
};

/// Reads what there is: columns that are missing are left out, a row cut short at the end is dropped.
/// Fails when the file can't be read or is no session.csv.
[[nodiscard]] tl::expected<SessionTrace, ReportError> read_session_csv(const std::string& path,
                                                                       std::size_t max_buckets = kMaxTraceBuckets);

}  // namespace farfeel::master_station
