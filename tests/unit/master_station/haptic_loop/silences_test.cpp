// A hand that presses harder and less hard while the slave falls silent for any time and comes back: the force on the
// hand makes no step, whenever it fades and whenever it returns, but for what the hand makes itself as it moves against
// the coupling's spring. A hand that sank at 60 mm/s, since nothing held it, makes 0.12 N a tick of a spring of 2 N/mm.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

TEST(Silences, OfAnyLengthMakeNoStepInTheForce) {
  double largest_N = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
    Rig rig{kMediumGrip, std::array{0.0, 0.005, 0.02, 0.05}[seed % 4], 1000};
    rig.remote.world.points_T = {{3e-3, 2e-3, 0}, {3e-3, -2e-3, 0}, {-3e-3, 2e-3, 0}, {-3e-3, -2e-3, 0}};
    rig.remote.world.material.stiffness_N_per_m = 500;
    const double spring_N_per_m =
        coupling_for(rig.device.capabilities(), {}, Rig::loop_settings().body, kTick_ns).stiffness_N_per_m;
    const double phase = uniform(0, 2 * std::numbers::pi);
    TickRecord last;
    std::int64_t next = 2000, back = 0;
    for (std::int64_t tick = 0; tick < 30'000; ++tick) {
      rig.remote.is_silent = tick >= next && tick < back;
      if (tick >= back && tick >= next) {
        next = tick + static_cast<std::int64_t>(uniform(700, 2000));
        back = next + static_cast<std::int64_t>(uniform(60, 2500));
      }
      const double press_N = 2 + std::sin(phase + 2 * std::numbers::pi * 0.5e-3 * static_cast<double>(tick));
      rig.device.hold_at({{1, 0, 0, 0}, {0, 0.1e-3, -press_N / kMediumGrip.stiffness_N_per_m}});
      const TickRecord record = rig.tick();
      const glm::dvec3 change_N = record.F_hand_W.force_N - last.F_hand_W.force_N;
      const glm::dvec3 by_hand_N = -spring_N_per_m * (record.X_WI.p - last.X_WI.p);
      const double step_N = std::min(glm::length(change_N), glm::length(change_N - by_hand_N));
      if (tick > 1500) {
        largest_N = std::max(largest_N, step_N);
        EXPECT_LE(step_N, 0.2) << "seed " << seed << ", tick " << tick << ", silent from " << next << " to " << back
                               << ", " << name(record.state) << " after " << name(last.state);
      }
      last = record;
    }
  }
  EXPECT_GT(largest_N, 0.01) << "nothing was felt";
}

}  // namespace
}  // namespace farfeel::master_station
