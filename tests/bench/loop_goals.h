// What the loop is meant to reach, held against what was measured.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/loop_sweep.h"
#include "tests/bench/loop_tick.h"

namespace farfeel::bench {

struct Goal {
  std::string what;
  double value, bound;  ///< met: value <= bound
  std::string unit;
  std::string worst;  ///< the cell that the value is from
  [[nodiscard]] bool is_met() const { return value <= bound; }
};

/// Tiles received for a first stroke of 50 mm at 100 mm/s, by one contact, rtt 100 ms.
struct FreshStroke {
  std::string scene;
  double during_kB_s, all_kB;  ///< while the hand moved; since the start, with what was sent around it while it dwelt
  double oracle_kB;            ///< what a feed that knew the path would have sent since the start
  long ticks, ticks_lacking;   ///< of the stroke, and those of them that lacked heights
};

[[nodiscard]] std::vector<Goal> goals_of(const std::vector<FreshStroke>&);
[[nodiscard]] std::vector<Goal> goals(const std::vector<LoopCell>&, const std::vector<FreshStroke>&, const TickTimes&);

}  // namespace farfeel::bench
