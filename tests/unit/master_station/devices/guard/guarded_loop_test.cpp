// The guard under the loop: what a person goes through when something breaks, with nobody at the keyboard but a reset.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/realtime_guard.h"
#include "tests/unit/master_station/devices/guard/pressing.h"

namespace farfeel::devices {
namespace {

using master_station::DeviceState;
using master_station::Fault;

TEST(GuardedLoopTest, TheSimulatedHandGripsAndFeelsWithoutBeingAsked) {
  Pressing rig;
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_GT(rig.force_N(), 1);
}

TEST(GuardedLoopTest, AfterAFaultAResetArmsAndAnewGripBringsTheForceBackGently) {
  Pressing rig;
  rig.remote.on_answer = [](contact::ContactSet& set) { set.contacts[0].depth_m = std::nan(""); };
  rig.run(200);
  EXPECT_EQ(rig.loop.fault(), Fault::kContactsNotUsable);
  EXPECT_EQ(rig.force_N(), 0);
  rig.remote.on_answer = nullptr;
  rig.run(100);
  rig.loop.reset_fault();
  rig.run(20);
  EXPECT_EQ(rig.guard.stage(), Stage::kReady) << "armed: the hand has let go of its button, and not pressed it again";
  EXPECT_EQ(rig.force_N(), 0);
  rig.run(1500);
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  EXPECT_LE(rig.largest_step_N, kJump_N);
  rig.device.hold_at({rig.device.true_pose().R, rig.device.true_pose().p - glm::dvec3(0, 0, 0.01)});
  rig.run(1000);
  EXPECT_GT(rig.force_N(), 0.5) << "pressed on, the surface is there";
}

TEST(GuardedLoopTest, UnpluggedAndPluggedInAgainItWaitsForAGripAndForNothingElse) {
  Pressing rig;
  bool is_gone = true;
  bool is_gripped = true;
  std::uint32_t opening = 0;
  rig.wires.on_read = [&](DeviceState& state) {
    if (is_gone) state.stage = Stage::kAbsent;
    if (!is_gripped) state.buttons = 0;
    state.opening = opening;
  };
  rig.run(1);
  EXPECT_EQ(rig.loop.fault(), Fault::kDeviceSilent);
  EXPECT_EQ(glm::length(rig.wires.written.force_N), 0) << "at once";
  rig.run(300);
  is_gone = false, ++opening;
  rig.run(500);
  EXPECT_EQ(rig.guard.stage(), Stage::kReady) << "the button was down all the time";
  EXPECT_EQ(rig.force_N(), 0);
  is_gripped = false;
  rig.run(10);
  is_gripped = true;
  rig.largest_step_N = 0;
  rig.run(1500);
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  EXPECT_LE(rig.largest_step_N, kJump_N) << "it takes hold of the tool where that is";
}

TEST(GuardedLoopTest, AHandThatSankInWithoutForceIsNotThrownOut) {
  Pressing rig;
  bool is_gripped = false;
  rig.wires.on_read = [&](DeviceState& state) { state.buttons = is_gripped ? 1 : 0; };
  rig.run(1500);
  EXPECT_EQ(rig.force_N(), 0);
  const double before_J = rig.device.hand_port().energy_J();
  is_gripped = true;
  rig.largest_step_N = 0;
  double least_J = before_J;
  for (int i = 0; i < 1500; ++i) {
    rig.run(1);
    least_J = std::min(least_J, rig.device.hand_port().energy_J());
  }
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_LE(rig.largest_step_N, kJump_N);
  EXPECT_GE(least_J, before_J - 3e-3) << "at most what the dent of the surface itself held, 3 N deep";
}

/// The machine stands still for a fifth of a second while the hand goes on.
TEST(GuardedLoopTest, AToolThatAStallLeftBehindIsTakenHoldOfAndNotFlungAfterTheHand) {
  Pressing rig;
  for (const double away_m : {0.02, 0.05, -0.02}) {
    spatial::Pose X = rig.device.true_pose();
    X.p.z += 0.02;  // free of the surface
    rig.device.hold_at(X);
    rig.run(1000);
    X.p.x += away_m;
    rig.device.hold_at(X);
    rig.time_ns += 200 * GuardedRig::kTick_ns;
    double most_N = 0;
    for (int i = 0; i < 1000; ++i) {
      rig.run(1);
      most_N = std::max(most_N, rig.force_N());
    }
    EXPECT_LT(most_N, 1) << away_m;
    EXPECT_EQ(rig.loop.fault(), Fault::kNone) << away_m;
  }
}

TEST(GuardedLoopTest, TorqueThatTheDeviceLacksIsTold) {
  Pressing rig(*find_model("simulated-late"));
  rig.device.hold_at({rig.device.true_pose().R, {0.03, 0, -0.02}});
  double masked_Nm = 0;
  for (int i = 0; i < 1500; ++i) {
    rig.run(1);
    masked_Nm = std::max(masked_Nm, rig.last.masked_torque_Nm);
    EXPECT_EQ(glm::length(rig.wires.written.torque_Nm), 0);
  }
  EXPECT_GT(masked_Nm, 1e-3);
  EXPECT_EQ(Pressing().last.masked_torque_Nm, 0);
}

TEST(GuardedLoopTest, ATickThroughTheGuardDoesNotAllocateLockOrThrow) {
  Pressing rig;
  using test_support::RealtimeGuard;
  if (!RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc and pthread_mutex_lock themselves";
  const std::uint64_t before = RealtimeGuard::violations();
  {
    const RealtimeGuard guard;
    for (int i = 0; i < 200; ++i) {
      (void)rig.guard.read(rig.time_ns);
      (void)rig.guard.render({{0.1, 0, 0}, {0, 0, i < 100 ? 1 : std::nan("")}}, {});
      rig.time_ns += GuardedRig::kTick_ns;
    }
    rig.guard.reset();
  }
  EXPECT_EQ(RealtimeGuard::violations(), before) << RealtimeGuard::first_violation();
}

}  // namespace
}  // namespace farfeel::devices
