// How long answers and ticks take in a few scenes, and how far forces are off there, with what is left out just now.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tests/bench/ablation_cases.h"

namespace farfeel::bench {

/// Of one walk through a scene: processor time of an answer or of a tick, on this thread.
struct SceneTimes {
  double p50_us = 0, p99_us = 0;
};

class AblationScenes {
 public:
  AblationScenes();
  ~AblationScenes();

  /// From nothing, through the whole scene or a tenth of it.
  [[nodiscard]] SceneTimes walk(Scene, bool is_short) const;
  /// Mean of how far the wrenches at some poses of the way are off the converged integral's, as a share; none where
  /// that is not known.
  [[nodiscard]] std::optional<double> wrench_off(Scene) const;
  /// Looks the truth up, with nothing left out: before the first wrench_off().
  void look_up_truth();

 private:
  struct Walk;
  [[nodiscard]] const Walk* walk_of(Scene) const;
  std::vector<std::unique_ptr<Walk>> walks_;
};

}  // namespace farfeel::bench
