// Hard cases of the haptic loop: each a press, stroke or twist in simulated time, with figures and a verdict.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/loop_watch.h"

namespace farfeel::bench {

struct LoopCaseRow {
  std::string name, rung, grip;
  double rtt_ms = 0, mass_kg = 0;
  LoopFigures figures;
  bool passes = false;
};

// only: cases whose name contains it.
/// Surfaces in closed form that change under the tool, links that stall, ridges: hardcases_loop.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_changes(const std::string& only);
/// Pegs, threads, gears, edges, tips, walls, through the real contact service: hardcases_real.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_real_shapes(const std::string& only);
/// Objects that turn, slide and rise under the tool: hardcases_moving.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_moving_objects(const std::string& only);

}  // namespace farfeel::bench
