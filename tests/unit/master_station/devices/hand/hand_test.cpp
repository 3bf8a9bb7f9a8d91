// The hand's mapping against its equations: where motions go, what comes back of force, and what hard input does.
#include "master_station/devices/hand/hand.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/unit/master_station/devices/hand/sources.h"

namespace farfeel::devices {
namespace {

constexpr double kDt_s = 1e-3;
constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A device of six, in pose and in force.
DeviceModel model_of_six() {
  DeviceModel model = model_of_three();
  model.rotation_dof = model.torque_dof = 3;
  return model;
}

double turn_between(const glm::dquat& a, const glm::dquat& b) {
  return glm::length(spatial::vector_from_rotation(a * glm::conjugate(b)));
}

/// A hand, its devices and a clock.
struct Bench {
  explicit Bench(const DeviceModel& model, HandSettings settings = {}, bool has_second = false, bool has_view = false,
                 const DeviceModel& second_model = model_of_rate())
      : primary(model),
        second(second_model),
        view(model_of_rate()),
        device(primary, limits()),
        hand(device, device, has_second ? &second : nullptr, has_view ? &view : nullptr, settings) {}
  static master_station::DeviceCapabilities limits() {
    master_station::DeviceCapabilities capabilities;
    capabilities.max_force_N = 1e6;  // so that the twist's torque is not cut
    return capabilities;
  }
  /// The handle goes on for a tick with that twist, in its own base.
  master_station::DeviceState go(const spatial::Twist& V) {
    primary.sample.X_BD = spatial::integrate(primary.sample.X_BD, V, kDt_s);
    primary.sample.V_BD_B = V;
    return read();
  }
  master_station::DeviceState read() { return hand.read(now_ns += kTick_ns); }
  master_station::DeviceState wait(int ticks) {
    master_station::DeviceState state;
    for (int i = 0; i < ticks; ++i) state = go({});
    return state;
  }

  TestSource primary, second, view;
  SourceDevice device;
  Hand hand;
  std::int64_t now_ns = 7'000'000'000;
};

HandSettings from(OrientationFrom orientation) {
  HandSettings settings;
  settings.orientation = orientation;
  settings.twist_button = 2;
  return settings;
}

TEST(HandTest, RightIsRightAndTheToolKeepsItsOrientationWithADeviceOfThree) {
  HandSettings settings;
  settings.X_BD_start = {spatial::rotation_from_vector({0.3, 0, 0}), {1, 2, 3}};
  Bench bench(model_of_three(), settings);
  bench.primary.sample.X_BD.p = {0, 0.01, 0.01};  // the middle of its workspace
  bench.read();
  EXPECT_TRUE(bench.hand.is_centred());
  const auto state = bench.go({{0, 0, 0}, {5, 0, 0}});
  EXPECT_LT(glm::length(state.X_BD.p - glm::dvec3(1.005, 2, 3)), 1e-12);
  EXPECT_EQ(state.V_BD_B.linear_m_s, glm::dvec3(5, 0, 0));
  EXPECT_LT(turn_between(state.X_BD.R, settings.X_BD_start.R), 1e-12);
  bench.hand.write({{0.5, 0, 0}, {0, 0, 2}});
  EXPECT_EQ(bench.primary.last.F_hand_B, (spatial::Wrench{{0, 0, 0}, {0, 0, 2}}));
  EXPECT_TRUE(bench.primary.last.is_force_on);
  EXPECT_EQ(bench.primary.last.opening, 1u);
  EXPECT_EQ(bench.primary.last.time_ns, bench.now_ns);
  EXPECT_EQ(bench.hand.masked_torque_Nm(), 0.5) << "nobody renders it: told";
  EXPECT_EQ(bench.hand.masked_force_N(), 0);
}

TEST(HandTest, OneToOneWithADeviceOfSixWhateverItsBaseIsTurned) {
  HandSettings settings = from(OrientationFrom::kOwn);
  settings.R_BP = spatial::rotation_from_vector({0, 0, std::numbers::pi / 2});
  Bench bench(model_of_six(), settings);
  bench.read();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return glm::dvec3(any(random), any(random), any(random)); };
  const spatial::Pose before = bench.primary.sample.X_BD;
  bench.device.hold_clutch(true);  // ends the centring
  bench.read();
  bench.device.hold_clutch(false);
  spatial::Pose expected = bench.read().X_BD;
  const spatial::Pose start = expected;
  for (int i = 0; i < 20'000; ++i) {  // many whole turns, in quaternions of either sign
    const spatial::Twist V{20.0 * vector() + glm::dvec3(0, 15, 0), vector()};
    const auto state = bench.go(V);
    if (i % 3 == 0) bench.primary.sample.X_BD.R = -bench.primary.sample.X_BD.R;
    expected = spatial::integrate(expected, {settings.R_BP * V.angular_rad_s, settings.R_BP * V.linear_m_s}, kDt_s);
    ASSERT_LT(glm::length(state.X_BD.p - expected.p), 1e-10);
    ASSERT_LT(turn_between(state.X_BD.R, expected.R), 1e-9);
    ASSERT_LT(glm::length(state.V_BD_B.angular_rad_s - settings.R_BP * V.angular_rad_s), 1e-12);
  }
  // It is the pose itself that is mapped, not only the sum of its changes.
  const spatial::Pose now = bench.primary.sample.X_BD;
  const glm::dquat turned = settings.R_BP * now.R * glm::conjugate(before.R) * glm::conjugate(settings.R_BP);
  EXPECT_LT(turn_between(bench.read().X_BD.R, turned * start.R), 1e-9);
  EXPECT_LT(glm::length(bench.read().X_BD.p - start.p - settings.R_BP * (now.p - before.p)), 1e-10);
}

/// The mapping makes no work: with whatever buttons, sources, views and bases, at every instant.
TEST(HandTest, HandAndImageExchangeTheSamePower) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return glm::dvec3(any(random), any(random), any(random)); };
  for (const bool has_torque : {true, false}) {
    HandSettings settings = from(OrientationFrom::kTwist);
    settings.R_BP = spatial::rotation_from_vector({0.3, -0.7, 2});
    DeviceModel model = model_of_six();
    if (!has_torque) model.rotation_dof = model.torque_dof = 0;
    Bench bench(model, settings, false, true);
    bench.primary.sample.X_BD.p = {0, 0.01, 0.01};
    double most_masked_Nm = 0;
    for (int i = 0; i < 20'000; ++i) {
      bench.primary.sample.buttons = i / 130 % 2 ? 4 : 0;
      bench.view.sample.deflection.turn.z = any(random);
      bench.hand.take_orientation_from(i / 1700 % 2 ? OrientationFrom::kOwn : OrientationFrom::kTwist);
      const spatial::Twist V{has_torque ? vector() : glm::dvec3(0), vector()};
      const auto state = bench.go(V);
      const spatial::Wrench F{vector(), vector()};
      bench.hand.write(F);
      if (i == 0) continue;  // the first reading is no motion
      ASSERT_NEAR(spatial::power_W(bench.primary.last.F_hand_B, V), spatial::power_W(F, state.V_BD_B), 1e-9) << i;
      most_masked_Nm = std::max(most_masked_Nm, bench.hand.masked_torque_Nm());
    }
    EXPECT_GT(most_masked_Nm, 0.5);
  }
}

TEST(HandTest, ATwistTurnsABallAndFeelsItsTorqueAsAForce) {
  Bench bench(model_of_three(), from(OrientationFrom::kTwist));
  bench.read();
  bench.primary.sample.buttons = 4;
  const spatial::Pose before = bench.wait(150).X_BD;
  auto state = bench.go({{}, {1, 0, 0}});
  EXPECT_LT(glm::length(state.X_BD.p - before.p), 1e-12) << "the tool turns where it is";
  EXPECT_LT(glm::length(state.V_BD_B.angular_rad_s - glm::dvec3(0, 0, Hand::kTwist_rad_per_m)), 1e-12);
  bench.hand.write({{0, 0, -0.1}, {3, 0, 0}});
  EXPECT_LT(glm::length(bench.primary.last.F_hand_B.force_N - glm::dvec3(-0.1 * Hand::kTwist_rad_per_m, 0, 0)), 1e-12);
  EXPECT_NEAR(bench.hand.masked_force_N(), 3, 1e-12);
  EXPECT_NEAR(bench.hand.masked_torque_Nm(), 0, 1e-12);
  state = bench.go({{}, {0, 0, 1}});
  EXPECT_LT(state.V_BD_B.angular_rad_s.x, -10) << "up turns the front up";
  state = bench.go({{}, {0, 1, 0}});
  EXPECT_GT(state.V_BD_B.angular_rad_s.y, 10);
}

TEST(HandTest, NothingJumpsWhateverChangesAndNothingGoesFasterThanTheHandle) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return glm::dvec3(any(random), any(random), any(random)); };
  Bench bench(model_of_six(), from(OrientationFrom::kTwist), true, true);
  spatial::Pose last = bench.read().X_BD;
  for (int i = 0; i < 30'000; ++i) {
    bench.primary.sample.buttons = random() % 8;  // chatters
    if (i % 97 == 0) bench.hand.take_orientation_from(static_cast<OrientationFrom>(random() % 4));
    if (i % 211 == 0) {  // another plugging in, elsewhere
      ++bench.primary.sample.opening;
      bench.primary.sample.X_BD = {spatial::rotation_from_vector(2.0 * vector()), vector()};
    }
    bench.primary.sample.stage = i / 50 % 7 == 0 ? Stage::kHoming : Stage::kReady;
    if (bench.primary.sample.stage == Stage::kHoming) bench.primary.sample.X_BD.p = vector();
    bench.second.sample.deflection.turn = vector();
    bench.second.is_there = i / 100 % 3 != 0;
    bench.view.sample.deflection.turn = vector();
    if (i % 401 == 0) bench.primary.sample.V_BD_B.linear_m_s.x = kNan;
    const spatial::Twist V{vector(), 0.5 * vector()};
    const auto state = bench.go(V);
    bench.hand.write({0.1 * vector(), 3.0 * vector()});
    const bool has_moved = spatial::is_valid(state.X_BD);
    ASSERT_TRUE(has_moved || i % 401 == 0);
    if (!has_moved) continue;
    ASSERT_LE(glm::length(state.X_BD.p - last.p), (1 + Hand::kCentring) * kDt_s * glm::length(V.linear_m_s) + 1e-12);
    ASSERT_LE(turn_between(state.X_BD.R, last.R),
              kDt_s * (glm::length(V.angular_rad_s) + 1 + Hand::kTwist_rad_per_m * glm::length(V.linear_m_s)) + 1e-9);
    last = state.X_BD;
  }
}

TEST(HandTest, WhatTurnsWithASecondDeviceOfPoseIsThatDevice) {
  DeviceModel stylus = model_of_six();
  stylus.force_dof = stylus.torque_dof = 0;
  HandSettings settings = from(OrientationFrom::kSecond);
  settings.R_BSecond = spatial::rotation_from_vector({0, 0, 1});
  Bench bench(model_of_three(), settings, true, false, stylus);
  const spatial::Pose start = bench.read().X_BD;
  glm::dquat R{1, 0, 0, 0};
  for (int i = 0; i < 1000; ++i) {
    R = spatial::rotation_from_vector({0.02, 0.003, 0}) * R;
    bench.second.sample.X_BD = {i % 2 ? -R : R, {0.1, 0.2, 0.3}};
    bench.read();
  }
  const glm::dquat expected = settings.R_BSecond * R * glm::conjugate(settings.R_BSecond);
  EXPECT_LT(turn_between(bench.read().X_BD.R, expected * start.R), 1e-9);
  EXPECT_TRUE(bench.hand.is_orientation_live());

  // One misread turn is not believed, nor is one that is not finite; the orientation stays.
  const glm::dquat before = bench.read().X_BD.R;
  bench.second.sample.X_BD.R = spatial::rotation_from_vector({0, 3, 0}) * R;
  EXPECT_LT(turn_between(bench.read().X_BD.R, before), 1e-12);
  bench.second.sample.X_BD.R = R;
  EXPECT_LT(turn_between(bench.read().X_BD.R, before), 1e-12);
  bench.second.sample.X_BD.R.x = kNan;
  EXPECT_LT(turn_between(bench.read().X_BD.R, before), 1e-12);
  EXPECT_FALSE(bench.hand.is_orientation_live());
  EXPECT_TRUE(bench.read().is_live) << "the hand goes on without";
}

class RateHandTest : public ::testing::TestWithParam<Reports> {
 protected:
  static DeviceModel model() {
    DeviceModel rate = model_of_rate();
    rate.reports = GetParam();
    return rate;
  }
};

TEST_P(RateHandTest, ARateMovesTheToolByItsSpeedAndStopsWithinTwentyMilliseconds) {
  HandSettings settings = from(OrientationFrom::kOwn);
  settings.rate_speed_m_s = 0.05;
  settings.workspace_scale = 2;
  Bench bench(model(), settings);
  bench.primary.sample.deflection.push = {0, 1, 0};
  bench.primary.sample.deflection.turn = {0, 0, 1};
  bench.read();
  auto state = bench.wait(100);
  EXPECT_NEAR(state.V_BD_B.linear_m_s.y, 0.025, 1e-12) << "0.05 m/s of the tool";
  EXPECT_NEAR(state.V_BD_B.angular_rad_s.z, 0.5, 1e-12) << "turning in proportion";
  EXPECT_NEAR(state.X_BD.p.y, 0.025 * kDt_s * (10.5 + 80), 1e-9);
  bench.primary.is_there = false;  // the owner is gone: the last sample stays, deflected
  state = bench.wait(10);
  EXPECT_GT(state.V_BD_B.linear_m_s.y, 0.02);
  state = bench.wait(10);
  EXPECT_EQ(state.V_BD_B.linear_m_s, glm::dvec3(0));
  EXPECT_EQ(state.V_BD_B.angular_rad_s, glm::dvec3(0));
  EXPECT_FALSE(state.is_live);
  const spatial::Pose stopped = state.X_BD;
  EXPECT_EQ(bench.wait(500).X_BD, stopped);
  bench.primary.is_there = true;
  EXPECT_NEAR(bench.read().V_BD_B.linear_m_s.y, 0.025 / 20, 1e-12) << "and begins anew, slowly";
  bench.primary.sample.stage = Stage::kAbsent;  // unplugged, and the owner says so
  EXPECT_EQ(bench.read().V_BD_B.linear_m_s, glm::dvec3(0));
}

TEST_P(RateHandTest, ItStaysInReachYieldsToForceAndItsClutchHolds) {
  HandSettings settings = from(OrientationFrom::kOwn);
  settings.reach_m = 0.02;
  Bench bench(model(), settings);
  bench.primary.sample.deflection.push = {1, 0, -1};
  bench.read();
  spatial::Pose before = bench.read().X_BD;
  for (int i = 0; i < 1000; ++i) {
    const auto state = bench.read();
    ASSERT_LT(glm::length(state.X_BD.p - before.p - kDt_s * state.V_BD_B.linear_m_s), 1e-12) << "twist and pose agree";
    before = state.X_BD;
  }
  EXPECT_EQ(before.p, glm::dvec3(0.02, 0, -0.02));
  bench.primary.sample.deflection.push = {-1, 0, 0};
  EXPECT_LT(bench.wait(100).X_BD.p.x, 0.015) << "and comes back at once";
  bench.primary.sample.deflection.push = {0, 0.8, 0};
  bench.wait(50);
  bench.hand.write({{}, {0, -0.5 * Hand::kYield_N, 0}});
  EXPECT_NEAR(bench.read().V_BD_B.linear_m_s.y, 0.5 * 0.1 * shaped(0.8), 1e-9);
  bench.hand.write({{}, {1, -2 * Hand::kYield_N, 0}});
  EXPECT_LT(glm::length(bench.read().V_BD_B.linear_m_s), 0.02) << "only along the force, not against it";
  EXPECT_FALSE(bench.primary.last.is_force_on);
  EXPECT_EQ(bench.primary.last.F_hand_B, spatial::Wrench{});
  EXPECT_GT(bench.hand.masked_force_N(), 5);
  bench.hand.write({});
  bench.primary.sample.buttons = 2;
  auto state = bench.wait(20);
  EXPECT_LT(glm::length(state.V_BD_B.linear_m_s), 1e-9);
  EXPECT_TRUE(state.is_clutch_held);
}

INSTANTIATE_TEST_SUITE_P(Reports, RateHandTest, ::testing::Values(Reports::kStream, Reports::kEvents));

TEST(HandTest, BeforeThePrimaryIsThereAndAfterItIsGoneThePoseStays) {
  HandSettings settings;
  settings.X_BD_start.p = {0.1, 0.2, 0.3};
  Bench bench(model_of_three(), settings);
  bench.primary.is_there = false;
  bench.primary.sample.stage = Stage::kAbsent;
  auto state = bench.read();
  EXPECT_FALSE(state.is_live);
  EXPECT_EQ(state.X_BD, settings.X_BD_start);
  bench.hand.write({{}, {1, 0, 0}});
  EXPECT_FALSE(bench.primary.last.is_force_on);
  bench.primary.is_there = true;
  bench.primary.sample.stage = Stage::kReady;
  bench.primary.sample.X_BD.p = {0.03, 0, 0};
  EXPECT_EQ(bench.read().X_BD, settings.X_BD_start);
  const spatial::Pose moved = bench.go({{}, {1, 0, 0}}).X_BD;
  // Not finite: passed on, so that whoever reads can latch it, and not kept.
  bench.primary.sample.X_BD.p.y = kNan;
  state = bench.read();
  EXPECT_FALSE(spatial::is_valid(state.X_BD));
  bench.hand.write({{}, {1, 0, 0}});
  EXPECT_FALSE(bench.primary.last.is_force_on);
  bench.primary.sample.X_BD.p = {0, 0, 0};
  EXPECT_EQ(bench.read().X_BD, moved);
  bench.hand.write({{kNan, 0, 0}, {1, 0, 0}});
  EXPECT_FALSE(bench.primary.last.is_force_on);
  EXPECT_EQ(bench.primary.last.F_hand_B, spatial::Wrench{});
  // Silent while it streams no more, though its owner still polls.
  bench.primary.is_there = false;
  bench.now_ns += 20'000'000;
  bench.primary.sample.polled_ns = bench.now_ns;
  EXPECT_FALSE(bench.read().is_live);
}

TEST(HandTest, CentringGoesWithTheHandleAndNeverAgainstTheForce) {
  Bench bench(model_of_three());
  bench.primary.sample.X_BD.p = {0.03, 0.01, -0.02};  // {0.03, 0, -0.03} off the middle
  spatial::Pose last = bench.read().X_BD;
  EXPECT_EQ(last, spatial::Pose{});
  EXPECT_FALSE(bench.hand.is_centred());
  // At rest, with readings that chatter, nothing is centred.
  for (int i = 0; i < 2000; ++i) last = bench.go({{}, {i % 2 ? 0.1 : -0.1, 0, 0}}).X_BD;
  EXPECT_LT(glm::length(last.p), 1e-12);
  // A force against it stops it; so does one that is felt.
  const auto stroke = [&](const glm::dvec3& F) {
    const glm::dvec3 before = bench.primary.sample.X_BD.p;
    double made_J = 0;
    for (int i = 0; i < 400; ++i) {
      bench.hand.write({{}, F});
      const auto state = bench.go({{}, {0, i < 200 ? 0.1 : -0.1, 0}});
      // What the hand gets, less what the image gives: the mapping's own work.
      made_J += kDt_s * (glm::dot(F, bench.primary.sample.V_BD_B.linear_m_s) - glm::dot(F, state.V_BD_B.linear_m_s));
      last = state.X_BD;
    }
    EXPECT_LT(glm::length(bench.primary.sample.X_BD.p - before), 1e-12);
    EXPECT_LE(made_J, 1e-12);
  };
  stroke({-0.1, 0, 0});
  EXPECT_LT(glm::length(last.p), 1e-12);
  stroke({1, 0, 0});
  EXPECT_LT(glm::length(last.p), 1e-12);
  stroke({0.1, 0, 0});
  EXPECT_NEAR(glm::length(last.p), 0.2 * 0.04, 0.001);
  for (int i = 0; i < 10; ++i) stroke({});
  EXPECT_TRUE(bench.hand.is_centred());
  EXPECT_LT(glm::length(last.p - glm::dvec3(0.03, 0, -0.03)), 2e-6)
      << "in the middle of the workspace the tool is at its start";
}

/// A guard of the simplest kind: no more than a newton, and it may say that nothing is live.
class OneNewton final : public master_station::Device {
 public:
  explicit OneNewton(master_station::Device& device) : device_(device) {}
  const master_station::DeviceCapabilities& capabilities() const noexcept override { return device_.capabilities(); }
  master_station::DeviceState read(std::int64_t time_ns) noexcept override {
    master_station::DeviceState state = device_.read(time_ns);
    state.is_live = state.is_live && !is_shut;
    return state;
  }
  void write(const spatial::Wrench& F) noexcept override {
    device_.write({F.torque_Nm, glm::length(F.force_N) > 1 ? glm::normalize(F.force_N) : F.force_N});
  }
  bool is_shut = false;

 private:
  master_station::Device& device_;
};

TEST(HandTest, TheGuardHasTheLastWordOnWhatTheMappingMakes) {
  TestSource three(model_of_three());
  SourceDevice device(three, Bench::limits());
  OneNewton guard(device);
  Hand hand(device, guard, nullptr, nullptr, from(OrientationFrom::kTwist));
  std::int64_t now_ns = 1'000'000'000;
  three.sample.buttons = 4;
  for (int i = 0; i < 200; ++i) (void)hand.read(now_ns += kTick_ns);
  hand.write({{0, 0, 5}, {0, 0, 0}});  // by the lever some 80 N
  EXPECT_NEAR(glm::length(three.last.F_hand_B.force_N), 1, 1e-12);
  guard.is_shut = true;
  three.sample.X_BD.p.x += 0.01;
  EXPECT_FALSE(hand.read(now_ns += kTick_ns).is_live);
  guard.is_shut = false;
  EXPECT_EQ(hand.read(now_ns += kTick_ns).X_BD, spatial::Pose{}) << "what moved in between is no motion of the tool";
}

TEST(HandTest, TheCouplingOfATwistIsThatOfItsLever) {
  HandSettings settings = from(OrientationFrom::kFixed);
  master_station::DeviceCapabilities limits;
  limits.stable_stiffness_N_per_m = 1000;
  limits.stable_damping_Ns_per_m = 0.5;
  limits.stable_rotational_stiffness_Nm_per_rad = 8;
  limits.stable_rotational_damping_Nms_per_rad = 0.01;
  limits.position_step_m = 1e-5;
  TestSource three(model_of_three());
  SourceDevice device(three, limits);
  const Hand fixed(device, device, nullptr, nullptr, settings);
  EXPECT_EQ(fixed.capabilities().stable_rotational_stiffness_Nm_per_rad, 8);
  settings.orientation = OrientationFrom::kTwist;
  const Hand twists(device, device, nullptr, nullptr, settings);
  constexpr double k = Hand::kTwist_rad_per_m;
  EXPECT_NEAR(twists.capabilities().stable_rotational_stiffness_Nm_per_rad, 1000 / (k * k), 1e-12);
  EXPECT_NEAR(twists.capabilities().stable_rotational_damping_Nms_per_rad, 0.5 / (k * k), 1e-12);
  EXPECT_NEAR(twists.capabilities().rotation_step_rad, k * 1e-5, 1e-12);
  EXPECT_EQ(twists.capabilities().stable_stiffness_N_per_m, 1000);
}

TEST(HandTest, ByDefaultWhatTurnsTheToolIsWhatCanBest) {
  EXPECT_EQ(default_twist_button(model_of_three()), 2);
  EXPECT_EQ(default_orientation(model_of_three(), true), OrientationFrom::kSecond);
  EXPECT_EQ(default_orientation(model_of_three(), false), OrientationFrom::kFixed);
  EXPECT_EQ(default_orientation(model_of_six(), false), OrientationFrom::kOwn);
  EXPECT_EQ(default_orientation(model_of_rate(), false), OrientationFrom::kOwn);
}

}  // namespace
}  // namespace farfeel::devices
