#include "slave_sim/bake/progress_words.h"

#include <fmt/format.h>

#include <cmath>

namespace farfeel::slave_sim {

std::string progress_words(const std::string& stage, double done, double elapsed_s) {
  constexpr double kLeast_s = 1, kLeastDone = 0.02;
  std::string words = fmt::format("{:3.0f} % {}", 100 * done, stage);
  if (elapsed_s < kLeast_s || done < kLeastDone) return words;
  const long left_s = std::lround(elapsed_s * (1 - done) / done);
  return words + fmt::format(", at most {}:{:02} left", left_s / 60, left_s % 60);
}

}  // namespace farfeel::slave_sim
