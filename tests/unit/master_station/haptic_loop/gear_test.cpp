// Workspace and force scale, and the clutch: alone against their equations, and in the closed loop.
#include <gtest/gtest.h>

#include <limits>

#include <cmath>
#include <random>

#include "master_station/haptic_loop/handle_gear.h"
#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

constexpr double kDt_s = 1e-3;

TEST(HandleGearTest, ImageAndHandExchangePowerInTheRatioOfTheScalesWhateverTheClutchDoes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return glm::dvec3(any(random), any(random), any(random)); };
  const GearScales scales{.workspace = 2.5, .force = 0.4};
  HandleGear gear(scales);
  spatial::Pose X_WD;
  gear.start(X_WD);
  for (int i = 0; i < 1000; ++i) {
    const spatial::Twist V{vector(), vector()};
    X_WD = spatial::integrate(X_WD, V, kDt_s);
    const spatial::Pose before = gear.X_WI();
    gear.advance(X_WD, V, i / 130 % 2 == 1, kDt_s);
    const spatial::Wrench F{vector(), vector()};
    const double at_image_W = spatial::power_W(F, gear.V_WI_W());
    EXPECT_NEAR(spatial::power_W(gear.on_hand(F), V), scales.force / scales.workspace * at_image_W, 1e-12);
    // The image moves as its twist says.
    const spatial::Pose moved = spatial::integrate(before, gear.V_WI_W(), kDt_s);
    EXPECT_LT(glm::length(moved.p - gear.X_WI().p), 1e-12);
    EXPECT_LT(glm::length(spatial::vector_from_rotation(moved.R * glm::conjugate(gear.X_WI().R))), 1e-9);
  }
}

TEST(HandleGearTest, WithoutAClutchTheButtonDoesNothingAndPlainScalesAreExact) {
  HandleGear gear({.has_clutch = false});
  gear.start({});
  for (int i = 1; i < 200; ++i) {
    const spatial::Pose X_WD{spatial::rotation_from_vector({0, 0.01 * i, 0}), {1e-3 * i, 0, 0}};
    gear.advance(X_WD, {}, true, kDt_s);
    EXPECT_LT(glm::length(gear.X_WI().p - X_WD.p), 1e-12);
  }
  EXPECT_EQ(gear.on_hand({{1, 2, 3}, {4, 5, 6}}), (spatial::Wrench{{1, 2, 3}, {4, 5, 6}}));
}

TEST(HandleGearTest, LedBackTheImageIsNeverFarAheadOfAToolThatIsHeldBack) {
  const spatial::Pose X_goal{spatial::rotation_from_vector({0, 0, 0.5}), {0.1, 0, 0}};
  HandleGear gear({});
  gear.start({});
  EXPECT_FALSE(gear.lead_to(X_goal, {}, kDt_s)) << "a hand holds it";
  EXPECT_EQ(gear.X_WI().p, glm::dvec3(0));
  gear.take_hold({}, {});
  for (int i = 0; i < 3000; ++i) {  // a surface holds it back
    EXPECT_FALSE(gear.lead_to(X_goal, {}, kDt_s));
    EXPECT_LE(glm::length(gear.X_WI().p), HandleGear::kAhead_m + 1e-12);
    EXPECT_LE(glm::length(spatial::vector_from_rotation(gear.X_WI().R)), HandleGear::kAhead_rad + 1e-9);
  }
  int ticks = 0;  // it follows
  while (!gear.lead_to(X_goal, gear.X_WI(), kDt_s) && ticks < 10'000) ++ticks;
  EXPECT_NEAR(ticks * kDt_s, 1, 0.05) << "0.1 m at 0.1 m/s";
  EXPECT_LT(glm::length(gear.X_WI().p - X_goal.p), 1e-6);
}

TEST(HandleGearTest, TheCouplingFeelsAsStiffAtTheHandAsTheDeviceAllows) {
  DeviceCapabilities device;
  device.stable_stiffness_N_per_m = 2000;
  device.stable_damping_Ns_per_m = 1;
  device.stable_rotational_stiffness_Nm_per_rad = 6;
  device.stable_rotational_damping_Nms_per_rad = 0.003;
  const GearScales scales{.workspace = 4, .force = 0.5};
  const tool::CouplingGains gains = coupling_for(device, scales, {}, kTick_ns);
  HandleGear gear(scales);
  gear.start({});
  gear.advance({spatial::rotation_from_vector({0, 0, 0.01}), {0.001, 0, 0}}, {}, false, kDt_s);
  const tool::VirtualCoupling coupling(gains, {});
  const spatial::Wrench F = gear.on_hand(coupling.evaluate(gear.X_WI(), {}, {}, {}).F_hand_W);
  EXPECT_NEAR(F.force_N.x, -2000 * 0.001, 1e-9);
  EXPECT_NEAR(F.torque_Nm.z, -6 * 0.01, 1e-9);
}

/// A shorter tick allows a stiffer spring, but no more damping: what rings on it is what is heavy.
TEST(CouplingTest, AFasterLoopIsStifferAsFarAsTheDampingHoldsTheTool) {
  DeviceCapabilities device;
  device.stable_stiffness_N_per_m = 1000;
  device.stable_damping_Ns_per_m = 1;
  device.stable_rotational_stiffness_Nm_per_rad = 1;
  device.stable_rotational_damping_Nms_per_rad = 1e-3;
  const Eigen::Matrix3d light = 4e-6 * Eigen::Matrix3d::Identity(), heavy = 1e-2 * Eigen::Matrix3d::Identity();
  const auto stiffness = [&](double mass_kg, const Eigen::Matrix3d& inertia, std::int64_t period_ns) {
    const tool::CouplingGains gains = coupling_for(device, {}, {mass_kg, inertia}, period_ns);
    EXPECT_EQ(gains.damping_Ns_per_m, 1);
    return glm::dvec2{gains.stiffness_N_per_m, gains.rotational_stiffness_Nm_per_rad};
  };
  EXPECT_EQ(stiffness(0.1, heavy, 1'000'000), glm::dvec2(1000, 1)) << "what the device states, for any tool";
  EXPECT_EQ(stiffness(0.1, heavy, 200'000), glm::dvec2(1000, 1));
  EXPECT_EQ(stiffness(0.001, light, 200'000), glm::dvec2(4000, 4)) << "faster than 4 kHz other limits rule";
  EXPECT_NEAR(stiffness(0.05, light, 250'000).x, 2000, 1e-9) << "a twentieth of what is critical";
}

class ScaledLoopTest : public ::testing::TestWithParam<GearScales> {};

TEST_P(ScaledLoopTest, ExploresPassivelyAndShowsBothScales) {
  const GearScales scales = GetParam();
  Rig rig(kMediumGrip, 0.02, 500, local_model::Rung::kLinear, scales);
  int touching = 0;
  for (int i = 0; i < 4'000; ++i) {
    const TickRecord record = rig.tick();
    ASSERT_NE(record.state, LoopState::kFault) << message(rig.loop.fault());
    touching += record.contacts > 0;
  }
  EXPECT_GE(touching, 2'200);
  EXPECT_GE(rig.device.hand_port().least_J(), -1e-6);

  rig.hold(3);
  TickRecord last;
  for (int i = 0; i < 1'500; ++i) last = rig.tick();
  EXPECT_NEAR(last.X_WI.p.z, scales.workspace * rig.device.true_pose().p.z, 2e-5 * scales.workspace);
  EXPECT_NEAR(last.F_hand_W.force_N.z, scales.force * last.F_contact_To_W.force_N.z, 0.05);
  EXPECT_GT(last.F_hand_W.force_N.z, 0.3);
}

INSTANTIATE_TEST_SUITE_P(Scales, ScaledLoopTest,
                         ::testing::Values(GearScales{0.25, 1}, GearScales{4, 1}, GearScales{1, 0.25}, GearScales{1, 4},
                                           GearScales{0.1, 10}, GearScales{3, 3}));

class ClutchTest : public ::testing::Test {
 protected:
  ClutchTest() {
    rig.hold(3);
    for (int i = 0; i < 1500; ++i) last = rig.tick();
    EXPECT_GT(last.F_hand_W.force_N.z, 1);
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const TickRecord record = rig.tick();
      EXPECT_LE(glm::length(record.F_hand_W.force_N - last.F_hand_W.force_N), 0.2) << "tick " << i;
      EXPECT_LE(glm::length(record.F_hand_W.torque_Nm - last.F_hand_W.torque_Nm), 0.02) << "tick " << i;
      last = record;
    }
  }
  Rig rig{kMediumGrip};
  TickRecord last;
};

TEST_F(ClutchTest, TheHandMovesFreelyTheToolStaysAndTheForceComesBackSmoothly) {
  const spatial::Pose X_WT = last.X_WT;
  rig.device.hold_clutch(true);
  run(200);
  EXPECT_LT(glm::length(last.F_hand_W.force_N), 1e-9);
  spatial::Pose X_WHand = rig.device.true_pose();
  for (int i = 0; i < 500; ++i) {
    X_WHand.p += glm::dvec3(1e-4, 4e-5, 1.6e-4);
    rig.device.hold_at(X_WHand);
    run(1);
  }
  run(500);
  EXPECT_LT(glm::length(last.F_hand_W.force_N), 1e-9);
  EXPECT_LT(glm::length(last.X_WT.p - X_WT.p), 0.002);  // let off: up by what the press had pushed it in
  EXPECT_LT(glm::length(rig.device.true_pose().p - X_WHand.p), 0.001);

  rig.device.hold_clutch(false);
  run(1000);
  EXPECT_LT(glm::length(last.F_hand_W.force_N), 0.3);  // nothing had been left waiting in the coupling
  EXPECT_LT(glm::length(last.X_WT.p - X_WT.p), 0.002);

  X_WHand = rig.device.true_pose();  // and the hand can press again, from where it is
  for (int i = 0; i < 100; ++i) {
    X_WHand.p.z -= 1e-4;
    rig.device.hold_at(X_WHand);
    run(1);
  }
  run(500);
  EXPECT_EQ(last.state, LoopState::kTouching) << message(rig.loop.fault());
  EXPECT_GT(last.F_hand_W.force_N.z, 1);
  EXPECT_GE(rig.device.hand_port().least_J(), -1e-6);
}

TEST_F(ClutchTest, NeverGivesTheHandMoreThanItPutIn) {
  // A hand that pumps: it presses, clutches, pulls away and lets go, at a period that is never a multiple of the ramps.
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i) {
    rig.device.hold_clutch(i % 2 == 0);
    spatial::Pose X_WHand = rig.device.true_pose();
    for (auto ticks = 30 + random() % 250; ticks > 0; --ticks) {
      X_WHand.p.z += i % 2 == 0 ? 1e-4 : -1e-4;
      rig.device.hold_at(X_WHand);
      last = rig.tick();
    }
  }
  EXPECT_GE(rig.device.hand_port().least_J(), -1e-6);
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
}

TEST(GearScales, TheOperatorHasTheLastWordOnForce) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const GearScales asked{2, 50, false};
  EXPECT_EQ(asked.with_force_at_most(1).force, 1);
  EXPECT_EQ(asked.with_force_at_most(100).force, 50);
  EXPECT_EQ((GearScales{1, kNan, true}.with_force_at_most(1).force), 1);
  EXPECT_EQ(asked.with_force_at_most(1).workspace, 2);
  EXPECT_FALSE(asked.with_force_at_most(1).has_clutch);
}

}  // namespace
}  // namespace farfeel::master_station
