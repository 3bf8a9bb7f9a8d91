// The loop's two plots, as SVG.
#pragma once

#include <string>
#include <vector>

#include "tests/bench/loop_sweep.h"

namespace farfeel::bench {

/// loop-delay.svg: force error against delay, a line a rung, mean over scenes at the fastest tick. loop-bandwidth.svg:
/// against bytes a second, a point a cell.
void write_loop_plots(const std::string& folder, const std::vector<LoopCell>&);

}  // namespace farfeel::bench
