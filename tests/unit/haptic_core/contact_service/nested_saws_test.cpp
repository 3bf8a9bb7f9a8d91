// Two saws, tooth in tooth or tooth on tooth: the stiffest textures to slide over each other, and what a wider soft
// maximum may change of their force.
#include <gtest/gtest.h>

#include <cmath>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"

namespace farfeel::contact_service {
namespace {

constexpr double kPitch_m = 0.5e-3, kHigh_m = 0.1e-3, kPress_m = 0.5e-3;

double saw_m(double x_m, double /*y_m*/) {
  const double x = x_m / kPitch_m;
  return -2 * kHigh_m * std::abs(x - std::floor(x) - 0.5);
}

struct Saws {
  geometry::HapticSurface table = slave_sim::height_plate(saw_m, {.size_m = {0.016, 0.012, 0.004}, .texel_m = 0.4e-4});
  geometry::HapticSurface tool = slave_sim::height_plate(saw_m, {.size_m = {8e-3, 6e-3, 0.004}, .texel_m = 0.4e-4});
  TouchableObject object, touching;

  /// N_per_m: of the contact; each side is twice as stiff.
  explicit Saws(double N_per_m) {
    object.felt = &table, touching.felt = &tool;
    object.material.stiffness_N_per_m = touching.material.stiffness_N_per_m = 2 * N_per_m;
    object.material.damping_Ns_per_m = touching.material.damping_Ns_per_m = 0;
    object.material.static_friction = object.material.dynamic_friction = 0;
  }
  [[nodiscard]] ContactService service(double most_stiffness_N_per_m) const {
    return ContactService({&object, 1}, touching, {.most_stiffness_N_per_m = most_stiffness_N_per_m});
  }
};

ToolPose pose(std::uint32_t tick, double x_m, double depth_m) {
  const glm::dquat turned_over{0, 1, 0, 0};
  ToolPose pose;
  pose.sequence = tick + 1;
  pose.time_ns = 1'000'000 * static_cast<std::int64_t>(tick);
  pose.X_WT = {turned_over, {x_m, 0, -depth_m}};
  return pose;
}

class NestedSaws : public testing::TestWithParam<double> {};

/// Slid 1 um a millisecond over a pitch, from tooth in tooth to tooth on tooth and on.
TEST_P(NestedSaws, AWiderSoftMaximumDoesNotPushHarderAndNothingJumps) {
  constexpr double kSameForce = 0.05, kMostStep_N = 0.1, kPressed_m = 5e-6;
  constexpr int kTicks = 500, kSettling = 50;
  const Saws saws(GetParam());
  ContactService wide = saws.service(kHeldStiffness_N_per_m), narrow = saws.service(0);
  glm::dvec3 last_N{0};
  double worst = 0, step_N = 0, widest_m = 0;
  for (int tick = -kSettling; tick < kTicks; ++tick) {
    const ToolPose at = pose(static_cast<std::uint32_t>(tick + kSettling), 1e-6 * std::max(tick, 0), kPress_m);
    const Answer &of_wide = wide.answer(at), &of_narrow = narrow.answer(at);
    const glm::dvec3 force_N = of_wide.F_To_W.force_N;
    widest_m = std::max(widest_m, of_wide.times.widest_m);
    if (tick >= 0 && of_narrow.count > 0 && of_narrow.contacts[0].depth_m > kPressed_m) {
      worst = std::max(worst, std::abs(force_N.z / of_narrow.F_To_W.force_N.z - 1));
      step_N = std::max(step_N, glm::distance(force_N, last_N));
    }
    last_N = force_N;
  }
  std::printf("%.0f N/mm: up to %.0f um wide, normal force within %.2f %% of the narrow one, at most %.3f N in 1 um\n",
              1e-3 * GetParam(), 1e6 * widest_m, 100 * worst, step_N);
  EXPECT_GT(widest_m, 12e-6) << "it was not put to the test";
  EXPECT_LT(worst, kSameForce);
  EXPECT_LT(step_N, kMostStep_N);
}
INSTANTIATE_TEST_SUITE_P(Stiffness, NestedSaws, testing::Values(2000.0, 4000.0));

}  // namespace
}  // namespace farfeel::contact_service
