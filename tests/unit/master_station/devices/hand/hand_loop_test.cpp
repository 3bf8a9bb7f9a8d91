// The hand in the closed loop, against a wall: what is felt, and that nothing that changes is felt as a step.
#include <gtest/gtest.h>

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
  Hand hand(three, &second, &view, settings);
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

}  // namespace
}  // namespace farfeel::devices
