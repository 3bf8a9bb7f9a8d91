#include "haptic_core/contact/wrench/wrench_stage.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farfeel::contact {
namespace {

TEST(WrenchStage, ASequenceOfAnswersSticksThenSlidesThenForgets) {
  WrenchStage stage;
  const auto answer = [&](double x_m, std::uint32_t id, const spatial::Pose& from_X_WT) {
    ContactSet set;
    set.X_WT = {{1, 0, 0, 0}, {x_m, 0, 0.02}};
    set.count = 1;
    Contact& contact = set.contacts[0];
    contact.id = id;
    contact.p_WC_W = {x_m, 0, 0};
    contact.nhat_ST_W = {0, 0, 1};
    contact.depth_m = 1e-3;  // its gradient is zero: the spring pushes nothing, and friction is seen alone
    contact.material = {.stiffness_N_per_m = 2000, .static_friction = 0.5, .dynamic_friction = 0.4};
    stage.add(set, {}, from_X_WT, {});
    return set;
  };
  ContactSet set = answer(0, 1, {});
  EXPECT_EQ(set.F_To_W.force_N.x, 0);
  set = answer(0.3e-3, 1, set.X_WT);
  EXPECT_NEAR(set.F_To_W.force_N.x, -kTangentialShare * 2000 * 0.3e-3, 1e-12);
  EXPECT_NEAR(set.F_To_W.torque_Nm.y, -0.02 * set.F_To_W.force_N.x, 1e-12);  // 20 mm below To
  for (int i = 2; i < 10; ++i) set = answer(0.3e-3 * i, 1, set.X_WT);
  EXPECT_NEAR(set.F_To_W.force_N.x, -0.4 * 2, 1e-12);
  set = answer(3.3e-3, 2, set.X_WT);
  EXPECT_EQ(set.F_To_W.force_N.x, 0) << "another contact starts without any";
}

// The direction turns by 2 degrees an answer while the tool slides; friction has no part along it.
TEST(WrenchStage, FrictionStaysAcrossADirectionThatTurns) {
  WrenchStage stage;
  spatial::Pose from_X_WT;
  double greatest_N = 0;
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.035 * i;
    ContactSet set;
    set.X_WT = {{1, 0, 0, 0}, {0.02e-3 * i, 0, 0.02}};
    set.count = 1;
    Contact& contact = set.contacts[0];
    contact.id = 1;
    contact.p_WC_W = {0.02e-3 * i, 0, 0};
    contact.nhat_ST_W = {std::sin(angle), 0, std::cos(angle)};
    contact.depth_m = 1e-3;  // its gradient is zero: the spring pushes nothing, and friction is seen alone
    contact.material = {.stiffness_N_per_m = 2000, .static_friction = 5, .dynamic_friction = 4};
    stage.add(set, {}, from_X_WT, {});
    from_X_WT = set.X_WT;
    EXPECT_NEAR(glm::dot(set.F_To_W.force_N, contact.nhat_ST_W), 0, 1e-12) << i;
    greatest_N = std::max(greatest_N, glm::length(set.F_To_W.force_N));
  }
  EXPECT_GT(greatest_N, 0.1) << "it sticks meanwhile";
}

}  // namespace
}  // namespace farfeel::contact
