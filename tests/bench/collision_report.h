// The collision benchmark's timings as a table and as a picture.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/collision_run.h"

namespace farfeel::bench {

struct TimingRow {
  std::string scene, entrant, motion;
  std::uint64_t seed;
  Timing time;
};

void write_csv(const std::string& path, const std::vector<TimingRow>& rows);
/// Bars from p50 to p99 on a logarithmic axis.
void write_svg(const std::string& path, const std::vector<TimingRow>& rows);

}  // namespace farfeel::bench
