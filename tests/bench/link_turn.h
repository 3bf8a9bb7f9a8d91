// A turn of `farfeel-bench link`: round trips at the haptic rate, each measured from before its message is made to when
// the answer is open in the caller's hands.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/bench/link_method.h"

namespace farfeel::bench {

struct Turn {
  std::size_t up_bytes = 0, down_bytes = 0;  ///< of a message, at least 8
  int round_trips = 0;                       ///< that are counted; some before them are not
};

struct TurnResult {
  std::vector<double> rtt_us;
  int lost = 0;          ///< without an answer within kGiveUp_ns
  bool is_fifo = false;  ///< both ends had real-time threads
  static constexpr std::int64_t kGiveUp_ns = 20'000'000;
};

/// Each end has a thread of its own that sleeps until shortly before its next message is due, then spins. That is how
/// the haptic thread works; the slave's would sleep all the time, and one wake-up costs more than all else here.
[[nodiscard]] TurnResult run_turn(LinkMethod&, const Turn&);

}  // namespace farfeel::bench
