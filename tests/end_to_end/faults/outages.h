// Outages of the link under a hand that presses and goes on holding its grip, in simulated time: whether a force that
// is older than the outage is ever played, how fast force returns, and whether it returns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace farfeel::end_to_end {

struct OutagesResult {
  std::size_t outages = 0;
  std::uint64_t played_old = 0;  ///< ticks with force from an answer that the fading should have ended
  double step_N_per_s_max = 0;   ///< of the force, from the link's return until the force is steady
  std::size_t not_back = 0;      ///< outages after which the force was not there again
  std::vector<std::string> words;
};

/// Beyond this rate no force returns.
inline constexpr double kMostReturn_N_per_s = 200;

/// Seeds from `seed` on, one outage each, of 20 ms to 5 s. Every core.
[[nodiscard]] OutagesResult survive_outages(std::size_t count, std::uint64_t seed);

}  // namespace farfeel::end_to_end
