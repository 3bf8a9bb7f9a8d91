// The contacts of a tick, one by one as the hand felt them, are what the tick's own force is made of.
#include "master_station/haptic_loop/tick_record.h"

#include <gtest/gtest.h>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

using Case = std::pair<local_model::Rung, tool::Integrator>;
class PushesTest : public ::testing::TestWithParam<Case> {};

TEST_P(PushesTest, AddUpToTheTicksForceAndNumberItsTicks) {
  const auto [rung, integrator] = GetParam();
  Rig rig(kMediumGrip, 0.02, 500, rung, {}, integrator);
  int touching = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const TickRecord record = rig.tick();
    ASSERT_EQ(record.number, i);
    glm::dvec3 sum_N(0);
    for (std::uint32_t p = 0; p < record.pushes.count; ++p) {
      const local_model::Push& push = record.pushes.of[p];
      sum_N += glm::dvec3(push.force_N);
      EXPECT_NEAR(glm::length(push.nhat_ST_W), 1, 1e-5);
    }
    // Each force is rounded to a float.
    EXPECT_LE(glm::distance(sum_N, record.F_contact_To_W.force_N), 1e-6 * (1e-3 + glm::length(sum_N))) << i;
    EXPECT_GE(record.pushes.count, record.contacts);
    touching += record.pushes.count >= 2;
  }
  EXPECT_GT(touching, 500);
}

INSTANTIATE_TEST_SUITE_P(Rungs, PushesTest,
                         ::testing::Values(Case{local_model::Rung::kLinear, tool::Integrator::kBackwardEuler},
                                           Case{local_model::Rung::kLinear, tool::Integrator::kMidpoint},
                                           Case{local_model::Rung::kQuadratic, tool::Integrator::kBackwardEuler}));

}  // namespace
}  // namespace farfeel::master_station
