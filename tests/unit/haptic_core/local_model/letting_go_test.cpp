// Walls that go while a soft hand leans on them with a tool of next to no mass: the force goes to zero in small steps,
// however stiff the wall was and however deep the hand sinks meanwhile.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Vector6;

constexpr double kTick_s = 1e-3;
constexpr int kGoes = 400, kTicks = 1200;  // when the wall goes, and the end

struct LettingGo {
  double leaned_N = 0;        ///< when the wall went
  double largest_step_N = 0;  ///< of force, from tick to tick from then on
  double last_N = 0;
};

/// A point on the plane z = level_m, both ways of going: the remote falls silent, or says that the wall is far below.
LettingGo leaned_on_a_wall_that_goes(double stiffness_N_per_m, bool is_silent) {
  constexpr double kHand_N_per_m = 250, kHand_Ns_per_m = 4, kLean_m = 0.012;
  LocalModel model{LocalModelSettings{}};
  tool::RigidTool body{{0.001, Eigen::Matrix3d::Identity() * 1e-6}, {}, {}};
  LettingGo found;
  for (int i = 0; i < kTicks; ++i) {
    model.advance(kTick_s, body.X_WT);
    contact::ContactSet set;
    set.X_WT = body.X_WT;
    set.count = 1;
    contact::Contact& contact = set.contacts[0];
    contact.p_WC_W = body.X_WT.p;
    contact.nhat_ST_W = {0, 0, 1};
    contact.gradient = spatial::to_vector6(spatial::Twist{{}, {0, 0, -1}});
    contact.depth_m = (i < kGoes ? 0 : -0.2) - body.X_WT.p.z;
    contact.lateral_range_m = 1;
    contact.material.stiffness_N_per_m = stiffness_N_per_m;
    if (i < kGoes || !is_silent) model.update(set, body.X_WT);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    forces.F_To_W[5] -= kHand_N_per_m * (body.X_WT.p.z + kLean_m) + kHand_Ns_per_m * body.V_WT_W.linear_m_s.z;
    forces.by_pose(5, 5) -= kHand_N_per_m;
    forces.by_twist(5, 5) -= kHand_Ns_per_m;
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    const Vector6 applied = tool::applied_wrench(felt.response, stepped, kTick_s);
    model.settle(applied, stepped.V_moved, kTick_s, body.X_WT);
    if (i < kGoes) found.leaned_N = applied[5];
    if (i >= kGoes) found.largest_step_N = std::max(found.largest_step_N, std::abs(applied[5] - found.last_N));
    found.last_N = applied[5];
  }
  return found;
}

class LettingGoTest : public testing::TestWithParam<double> {};

TEST_P(LettingGoTest, AWallThatTheRemoteIsSilentAboutFadesWithoutAStep) {
  const LettingGo found = leaned_on_a_wall_that_goes(GetParam(), true);
  EXPECT_GT(found.leaned_N, 2);
  EXPECT_LT(found.largest_step_N, 0.12);
  EXPECT_EQ(found.last_N, 0);
}

TEST_P(LettingGoTest, AWallThatIsGoneIsLetGoOfWithoutAStep) {
  const LettingGo found = leaned_on_a_wall_that_goes(GetParam(), false);
  EXPECT_GT(found.leaned_N, 2);
  EXPECT_LT(found.largest_step_N, 0.2);
  EXPECT_EQ(found.last_N, 0);
}

INSTANTIATE_TEST_SUITE_P(Stiffnesses, LettingGoTest, testing::Values(2000.0, 1e4, 5e4),
                         [](const auto& tried) { return std::to_string(std::lround(tried.param)) + "_N_per_m"; });

}  // namespace
}  // namespace farfeel::local_model
