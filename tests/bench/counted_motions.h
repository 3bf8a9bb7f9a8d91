// Rows of counted work: what is done along each frozen motion. One thread; no clock is read for any decision.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/counted_inputs.h"

namespace farfeel::bench {

struct CountedRow {
  std::string name;
  std::vector<std::pair<std::string, std::uint64_t>> counts;  ///< what is zero is left out
};

/// proximity/SCENE: pairs of pieces nearer than 5 mm, at 1 kHz. frame/SCENE: the whole contact frame on the same poses.
/// tick/seven-contacts: a haptic loop at 4 kHz. loop/stroke: a loop on tiles at 1 kHz, 20 ms from the remote; its
/// work is that of the ticks alone. only: rows whose name holds that.
[[nodiscard]] std::vector<CountedRow> counted_rows(const CountedInputs&, const std::string& only);

}  // namespace farfeel::bench
