// Real shapes and what a hand does with them: pegs, threads, gears, edges, tips, walls.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/felt_pair.h"

namespace farfeel::bench {

struct RealCase {
  std::unique_ptr<FeltPair> pair;
  spatial::Pose X_start;  ///< of the tool in W, touching nothing or with play
  /// Where the hand wants the tool, from 0 (begins to move) over 1 (has come to rest) on, beyond the push: in W.
  std::function<spatial::Pose(double)> X_wanted;
  glm::dvec3 push_W;    ///< direction the hand leans in at the end, unit; 0: none
  double hooked_m = 0;  ///< how far the hand pulls on, across its push, at a tool that hooks behind something stiff

  [[nodiscard]] const std::string& name() const { return pair->name(); }
};

[[nodiscard]] std::vector<RealCase> real_cases();

}  // namespace farfeel::bench
