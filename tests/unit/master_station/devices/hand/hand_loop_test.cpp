// The hand in the closed loop, against a wall: what is felt, and that nothing that changes is felt as a step.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/realtime_guard.h"
#include "tests/unit/master_station/devices/hand/wall_rig.h"

namespace farfeel::devices {
namespace {

using master_station::Fault;
using master_station::LoopState;

/// Brings the tool down until about 2 N are felt.
void press(WallRig& rig) {
  for (int i = 0; i < 3000 && rig.felt_N.z < 2; ++i) rig.run(1, {0, 0, -2e-5});
  rig.run(300);
}

TEST(HandLoopTest, TheToolStartsAtItsStartWhereverTheHandleIsHeld) {
  const spatial::Pose X_start{spatial::rotation_from_vector({0, 0, 0.4}), {0.2, -0.1, 0.3}};
  WallRig rig(OrientationFrom::kFixed, nullptr, nullptr, model_of_three(), X_start);
  rig.run(1);
  EXPECT_LT(glm::length(rig.last.X_WI.p - X_start.p), 1e-12);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(rig.last.X_WI.R * glm::conjugate(X_start.R))), 1e-9);
}

TEST(HandLoopTest, ADeviceOfThreePressesAWallAndFeelsIt) {
  WallRig rig;
  rig.run(200);
  press(rig);
  EXPECT_EQ(rig.last.state, LoopState::kTouching) << master_station::message(rig.loop.fault());
  EXPECT_GT(rig.felt_N.z, 1.5);
  EXPECT_NEAR(rig.felt_N.z, rig.last.F_contact_To_W.force_N.z, 0.1);
  EXPECT_LT(glm::length(spatial::vector_from_rotation(rig.last.X_WI.R)), 1e-12) << "nothing turns the tool";
  EXPECT_GE(rig.source.device.hand_port().least_J(), -1e-6);
  // Along the wall, and off it again.
  rig.run(500, {3e-5, 0, 0});
  EXPECT_GT(rig.felt_N.z, 1);
  rig.run(500, {0, 0, 4e-5});
  EXPECT_EQ(rig.last.state, LoopState::kFree);
  EXPECT_GE(rig.source.device.hand_port().least_J(), -1e-6);
}

TEST(HandLoopTest, ReadAndWriteAllocateNothing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc themselves";
  TestSource three(model_of_three()), second(model_of_rate()), view(model_of_rate());
  HandSettings settings;
  settings.orientation = OrientationFrom::kSecond;
  SourceDevice device(three, {});
  Hand hand(device, device, &second, &view, settings);
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  for (int i = 0; i < 3000; ++i) {
    three.sample.X_BD.p = {1e-5 * i, 0, 0};
    three.sample.buttons = static_cast<std::uint32_t>(i / 37 % 8);
    second.sample.deflection.turn = {0.5, 0, i % 2 ? 0.1 : -0.1};
    view.sample.deflection.turn.z = 0.7;
    three.is_there = i % 500 < 450;
    hand.take_orientation_from(static_cast<OrientationFrom>(i / 300 % 4));
    const test_support::RealtimeGuard guard;
    (void)hand.read(1'000'000'000 + i * kTick_ns);
    hand.write({{0.1, 0, 0}, {0, 1, 2}});
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
}

/// A button that chatters, held and let go at times that are no multiple of any ramp, while the tool is pressed.
TEST(HandLoopTest, ATwistUnderPressureIsNoStepHoweverItsButtonChatters) {
  WallRig rig(OrientationFrom::kTwist);
  rig.run(200);
  press(rig);
  std::mt19937 random(3);
  const std::uint32_t button = 1U << static_cast<unsigned>(default_twist_button(rig.source.data));
  for (int i = 0; i < 60; ++i) {
    for (int chatter = 0; chatter < 5; ++chatter) {
      rig.source.sample.buttons ^= button;
      rig.run(1 + static_cast<int>(random() % 3));
    }
    const double way = i % 2 ? 2e-5 : -2e-5;
    rig.run(20 + static_cast<int>(random() % 200), {way, -way, 0});
    ASSERT_EQ(rig.loop.fault(), Fault::kNone);
  }
  EXPECT_GT(glm::length(spatial::vector_from_rotation(rig.last.X_WI.R)), 1e-3) << "it was turned";
  EXPECT_GE(rig.source.device.hand_port().least_J(), -1e-6) << "and gave nothing that the hand had not put in";
}

TEST(HandLoopTest, AnotherSourceOfOrientationUnderPressureIsNoStep) {
  TestSource puck(model_of_rate());
  WallRig rig(OrientationFrom::kFixed, &puck);
  rig.run(200);
  press(rig);
  for (int i = 0; i < 40; ++i) {
    puck.sample.deflection.turn = {i % 3 - 1, i / 3 % 3 - 1, 1};
    puck.is_there = i % 4 != 3;  // unplugged while it turns
    if (i % 5 == 0) rig.hand.take_orientation_from(i % 2 ? OrientationFrom::kFixed : OrientationFrom::kSecond);
    rig.run(73, {1e-5, 0, 0});
    EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  }
  EXPECT_GT(glm::length(spatial::vector_from_rotation(rig.last.X_WI.R)), 0.05);
}

/// The tool is turned flat against the wall, which turns it back: nobody feels that, so the turning gives way.
TEST(HandLoopTest, ARateThatTurnsTheToolIntoAWallYieldsAndItsTorqueIsTold) {
  TestSource puck(model_of_rate());
  WallRig rig(OrientationFrom::kSecond, &puck);
  rig.run(200);
  press(rig);
  puck.sample.deflection.turn = {0, 0.9, 0};
  double most_masked_Nm = 0;
  for (int i = 0; i < 2000; ++i) {
    rig.run(1);
    most_masked_Nm = std::max(most_masked_Nm, rig.hand.masked_torque_Nm());
  }
  EXPECT_GT(most_masked_Nm, 0.03);
  EXPECT_LT(most_masked_Nm, 2 * Hand::kYield_Nm);
  EXPECT_EQ(rig.source.last.F_hand_B.torque_Nm, glm::dvec3(0));
}

TEST(HandLoopTest, TurningTheViewUnderPressureTurnsTheMappingWithoutAStep) {
  TestSource puck(model_of_rate());
  WallRig rig(OrientationFrom::kFixed, nullptr, &puck);
  rig.run(200);
  press(rig);
  const spatial::Pose before = rig.last.X_WI;
  puck.sample.deflection.turn = {0.3, 0.2, 1};
  while (rig.hand.view_yaw_rad() < std::numbers::pi / 2) rig.run(1);
  puck.sample.deflection.turn = {};
  rig.run(100);
  const double yaw_rad = rig.hand.view_yaw_rad();
  EXPECT_LT(glm::length(rig.last.X_WI.p - before.p), 2e-4) << "the view alone moves nothing";
  const glm::dvec3 from = rig.last.X_WI.p;
  rig.run(400, {5e-5, 0, 0});
  rig.run(400);
  const glm::dvec3 along = rig.last.X_WI.p - from;
  EXPECT_NEAR(std::atan2(along.y, along.x), yaw_rad, 0.02) << "right is right of the turned view";
  EXPECT_NEAR(glm::length(along), 0.02, 0.002);
  EXPECT_GT(rig.felt_N.z, 1) << "up is up";
}

/// Unplugged while it presses, carried elsewhere, plugged in again: the tool is taken hold of where it is.
TEST(HandLoopTest, AnotherPluggingInIsNoStepOfTheToolOrOfForce) {
  WallRig rig;
  rig.run(200);
  press(rig);
  for (int again = 0; again < 3; ++again) {
    rig.source.unplug();
    rig.most_step_N = 20;  // the device itself drops its force
    rig.run(1);
    rig.most_step_N = 0.2;
    rig.run(300, {5e-5, 0, again == 1 ? -1e-4 : 1e-4});
    EXPECT_EQ(rig.loop.fault(), Fault::kDeviceSilent);
    EXPECT_EQ(glm::length(rig.felt_N), 0);
    const spatial::Pose X_WT = rig.last.X_WT;
    rig.source.plug_in();
    rig.run(50);
    EXPECT_EQ(glm::length(rig.felt_N), 0) << "not before the reset";
    rig.loop.reset_fault();
    rig.run(500);
    EXPECT_EQ(rig.loop.fault(), Fault::kNone);
    EXPECT_LT(glm::length(rig.last.X_WT.p - X_WT.p), 1e-3);
    press(rig);
    EXPECT_GT(rig.felt_N.z, 1);
  }
}

/// The button that twists is held when the plug is pulled, and is not when it is plugged in again, or is.
TEST(HandLoopTest, UnpluggedInTheMiddleOfATwist) {
  WallRig rig(OrientationFrom::kTwist);
  rig.run(200);
  const std::uint32_t button = 1U << static_cast<unsigned>(default_twist_button(rig.source.data));
  for (int again = 0; again < 4; ++again) {
    press(rig);
    rig.source.sample.buttons = button;
    rig.run(37 + 60 * again, {2e-5, 0, 0});
    rig.source.unplug();
    rig.most_step_N = 20;  // the device itself drops its force
    rig.run(1);
    rig.most_step_N = 0.2;
    rig.run(100, {1e-4, 1e-4, 1e-4});
    const spatial::Pose X_WI = rig.last.X_WI, X_WT = rig.last.X_WT;
    rig.source.plug_in();
    rig.source.sample.buttons = again % 2 ? button : 0;
    rig.run(1);
    EXPECT_LT(glm::length(rig.last.X_WI.p - X_WI.p), 2e-5) << "but what the gear lets off";
    rig.loop.reset_fault();
    rig.run(150);
    EXPECT_LT(glm::length(spatial::vector_from_rotation(rig.last.X_WT.R * glm::conjugate(X_WT.R))), 0.02);
    EXPECT_LT(glm::length(rig.last.X_WT.p - X_WT.p), 1e-3);
    rig.source.sample.buttons = 0;
    rig.run(300);
    EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  }
}

/// Loop, mapping, guard, device, as a master has them: force comes with the device's own button, the mapping changes
/// under pressure, the plug is pulled, and force comes back with the button alone.
TEST(HandLoopTest, WithTheGuardBetweenMappingAndDevice) {
  const spatial::Pose X_start{{1, 0, 0, 0}, {0, 0, 0.01}};
  TestSource puck(model_of_rate());
  WallRig rig(OrientationFrom::kTwist, &puck, nullptr, simulated_model_of_three(), X_start, true);
  const std::uint32_t enable = 1, twist = 4;
  rig.run(200);
  for (int again = 0; again < 3; ++again) {
    rig.run(300, {0, 0, -2e-5});
    EXPECT_EQ(glm::length(rig.felt_N), 0) << "nothing without the button";
    EXPECT_EQ(rig.guard.stage(), Stage::kReady);
    rig.source.sample.buttons = enable;
    rig.run(1);
    EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
    press(rig);
    EXPECT_GT(rig.felt_N.z, 1.5);
    EXPECT_NEAR(rig.felt_N.z, rig.last.F_hand_W.force_N.z, 0.05) << "the record has what the hand gets";
    for (int i = 0; i < 10; ++i) {
      rig.source.sample.buttons ^= twist;
      rig.run(61, {1e-5, i % 2 ? 1e-5 : -1e-5, 0});
    }
    rig.hand.take_orientation_from(OrientationFrom::kSecond);
    puck.sample.deflection.turn = {0, 0, 0.7};
    rig.run(300);
    puck.sample.deflection.turn = {};
    rig.hand.take_orientation_from(OrientationFrom::kTwist);
    rig.run(300);
    EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
    rig.source.unplug();
    rig.most_step_N = 20;  // the device itself drops its force
    rig.run(1);
    rig.most_step_N = 0.2;
    rig.run(100, {0, 0, 1e-4});
    EXPECT_EQ(rig.loop.fault(), Fault::kDeviceSilent);
    rig.source.plug_in();
    rig.run(200);
    EXPECT_EQ(glm::length(rig.felt_N), 0) << "a button that was held all the while is no edge";
    rig.source.sample.buttons = 0;
    rig.run(50, {0, 0, 1e-4});
  }
  EXPECT_GT(rig.source.last.opening, 3u);
}

TEST(HandLoopTest, CentringAndTheClutchOnTheWayToAWallAreNoStep) {
  WallRig rig;
  rig.run(200);
  EXPECT_FALSE(rig.hand.is_centred());
  rig.run(300, {1e-4, 0, 0});
  rig.run(300, {-1e-4, 0, 0});
  press(rig);
  EXPECT_GT(rig.felt_N.z, 1);
  rig.source.sample.buttons = 2;
  rig.run(300, {0, 0, 1e-4});
  EXPECT_LT(glm::length(rig.felt_N), 1e-6);
  EXPECT_TRUE(rig.hand.is_centred()) << "the person says where the middle is";
  rig.source.sample.buttons = 0;
  rig.run(500);
  rig.device.hold_clutch(true);
  rig.run(200, {0, 0, 1e-4});
  rig.device.hold_clutch(false);
  rig.run(300);
  press(rig);
  EXPECT_GT(rig.felt_N.z, 1);
  EXPECT_GE(rig.source.device.hand_port().least_J(), -1e-6);
}

/// A device without force drives the tool into a wall for two seconds: it presses as hard as a person would, and is off
/// the wall as soon as it is pulled.
TEST(HandLoopTest, ARateInputAlonePressesAWallNoHarderThanAPersonAndLeavesItAtOnce) {
  TestSource puck(model_of_rate());
  HandSettings settings;
  settings.orientation = OrientationFrom::kOwn;
  settings.X_BD_start.p = {0, 0, 0.01};
  SourceDevice device(puck, {});
  Hand hand(device, device, nullptr, nullptr, settings);
  test_support::AnalyticRemote remote;
  remote.answer_period_ns = 2'000'000;
  remote.world.points_T = {{0.03, 0.01, -0.003}, {0.03, -0.01, -0.003}, {-0.03, 0, -0.003}};
  master_station::HapticLoop loop(hand, remote, WallRig::loop_settings());
  master_station::TickRecord last;
  std::int64_t time_ns = 1'000'000'000;
  double most_N = 0;
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      loop.tick({time_ns, 0, 0, 0});
      time_ns += kTick_ns;
      ASSERT_TRUE(loop.records().pop(last));
      most_N = std::max(most_N, glm::length(last.F_contact_To_W.force_N));
    }
  };
  run(100);
  puck.sample.deflection.push = {0, 0, -1};
  run(2000);
  EXPECT_EQ(last.state, LoopState::kTouching) << master_station::message(loop.fault());
  EXPECT_GT(glm::length(last.F_contact_To_W.force_N), 0.8 * Hand::kYield_N);
  EXPECT_LT(most_N, 1.5 * Hand::kYield_N);
  EXPECT_NEAR(hand.masked_force_N(), Hand::kYield_N, 0.5);
  puck.sample.deflection.push = {0, 0, 1};
  run(250);
  EXPECT_EQ(last.state, LoopState::kFree);
}

/// A rate input has brought the tool to the end of its reach.
TEST(HandLoopTest, RecentredWhilePausedARateInputHasItsWholeReachAgain) {
  TestSource puck(model_of_rate());
  HandSettings settings;
  settings.orientation = OrientationFrom::kOwn;
  settings.X_BD_start.p = {0, 0, 0.01};
  SourceDevice device(puck, {});
  Hand hand(device, device, nullptr, nullptr, settings);
  test_support::AnalyticRemote remote;
  remote.answer_period_ns = 2'000'000;
  remote.world.points_T = {{0, 0, -0.003}};
  master_station::HapticLoop loop(hand, remote, WallRig::loop_settings());
  master_station::TickRecord last;
  std::int64_t time_ns = 1'000'000'000;
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      loop.tick({time_ns, 0, 0, 0});
      time_ns += kTick_ns;
      ASSERT_TRUE(loop.records().pop(last));
    }
  };
  puck.sample.deflection.push = {1, 0, 0};
  run(10'000);
  ASSERT_NEAR(last.X_WT.p.x, settings.reach_m, 0.01);
  puck.sample.deflection = {};
  run(500);
  loop.pause(true);
  loop.recentre();
  run(6000);
  EXPECT_EQ(loop.fault(), Fault::kNone);
  EXPECT_LT(glm::length(last.X_WT.p - settings.X_BD_start.p), 1e-3);
  loop.pause(false);
  puck.sample.deflection.push = {1, 0, 0};
  run(3000);
  EXPECT_GT(last.X_WT.p.x, 0.05);
  EXPECT_EQ(loop.fault(), Fault::kNone);
}

}  // namespace
}  // namespace farfeel::devices
