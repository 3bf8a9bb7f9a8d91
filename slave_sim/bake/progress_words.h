// What a bake does and how long it still takes, in a line.
#pragma once

#include <string>

namespace farfeel::slave_sim {

/// " 25 % rays, at most 0:30 left", after that many seconds; the time only once there is something to go by. done: in
/// [0, 1].
[[nodiscard]] std::string progress_words(const std::string& stage, double done, double elapsed_s);

}  // namespace farfeel::slave_sim
