// On which side of the surface a ball's middle is, along any path.
#pragma once

#include "tests/bench/touch_truth.h"

namespace farfeel::bench {

/// Where a ball's middle is, from tick to tick: before the surface that it came to, or behind it.
class SideWatch {
 public:
  /// At first it is outside.
  SideWatch(const TouchTruth& truth, const glm::dvec3& p_O) : truth_(truth), last_O_(p_O) {}
  /// The ways out for a ball of that radius, its middle now at p_O.
  [[nodiscard]] TrueTouch move_to(const glm::dvec3& p_O, double radius_m);
  [[nodiscard]] bool is_behind() const { return is_behind_; }

 private:
  const TouchTruth& truth_;
  glm::dvec3 last_O_, out_O_{0, 0, 1};
  bool is_behind_ = false;
};

/// How much of what should push back does, the best of the ways out: of stiffness x depth, or of the most that there
/// is.
[[nodiscard]] double pushed_back_share(const TrueTouch&, const glm::dvec3& force_N, double stiffness_N_per_m,
                                       double most_N);

}  // namespace farfeel::bench
