// A hand that presses a surface with 3 N through loop and guard, and how much the force changed at most in a tick.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/guarded_rig.h"

namespace farfeel::devices {

using master_station::TickRecord;

constexpr double kJump_N = 0.2;

struct Pressing : GuardedRig {
  explicit Pressing(const DeviceModel& model = *find_model("simulated"))
      : GuardedRig(master_station::kMediumGrip, model) {
    spatial::Pose X = device.explorer().X_WHand();
    X.p = {0, 0, 0.003 - 3 / master_station::kMediumGrip.stiffness_N_per_m};
    device.hold_at(X);
    run(1500);
    largest_step_N = 0;
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const TickRecord next = tick();
      largest_step_N = std::max(largest_step_N, glm::length(next.F_hand_W.force_N - last.F_hand_W.force_N));
      last = next;
    }
  }
  [[nodiscard]] double force_N() const { return glm::length(last.F_hand_W.force_N); }
  TickRecord last;
  double largest_step_N = 0;
};

}  // namespace farfeel::devices
