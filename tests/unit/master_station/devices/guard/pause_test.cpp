// A person pauses amid a touch, and goes on: nothing is felt as a blow, and force comes with the device's own grip
// alone.
#include "tests/unit/master_station/devices/guard/pressing.h"

namespace farfeel::devices {
namespace {

using master_station::DeviceState;
using master_station::Fault;
using master_station::LoopState;

struct Paused : Pressing {
  Paused() {
    wires.on_read = [this](DeviceState& state) { state.buttons = is_gripped ? 1 : 0; };
    X_WT_start = X_start();
  }
  /// The tool began where the hand was first read.
  static spatial::Pose X_start() { return GuardedRig().tick().X_WT; }
  void grip_anew() {
    is_gripped = false;
    run(10);
    is_gripped = true;
  }
  [[nodiscard]] double from_start_m() const { return glm::length(last.X_WT.p - X_WT_start.p); }
  bool is_gripped = true;
  spatial::Pose X_WT_start;
};

TEST(PauseTest, AmidATouchTheForceFadesWithoutAStepAndStaysOff) {
  Paused rig;
  ASSERT_GT(rig.force_N(), 1);
  rig.loop.pause(true);
  rig.run(1);
  EXPECT_GT(rig.force_N(), 1) << "not let go of at once";
  rig.run(200);
  EXPECT_LE(rig.largest_step_N, kJump_N);
  EXPECT_EQ(rig.last.state, LoopState::kPaused);
  EXPECT_EQ(rig.force_N(), 0);
  rig.device.hold_at({rig.device.true_pose().R, rig.device.true_pose().p - glm::dvec3(0, 0, 0.02)});
  rig.largest_step_N = 0;
  rig.run(1000);
  EXPECT_EQ(rig.largest_step_N, 0) << "pressed on, nothing is there";
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
}

TEST(PauseTest, ResumedItIsArmedAndAnewGripBringsTheForceBackGently) {
  Paused rig;
  rig.loop.pause(true);
  rig.run(300);
  rig.loop.pause(false);
  rig.run(500);
  EXPECT_EQ(rig.last.state, LoopState::kTouching);
  EXPECT_EQ(rig.guard.stage(), Stage::kReady) << "a button that was held all the while is no edge";
  EXPECT_EQ(rig.force_N(), 0);
  rig.largest_step_N = 0;
  rig.grip_anew();
  rig.run(1000);
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_LE(rig.largest_step_N, kJump_N);
  rig.device.hold_at({rig.device.true_pose().R, rig.device.true_pose().p - glm::dvec3(0, 0, 0.01)});
  rig.run(1000);
  EXPECT_GT(rig.force_N(), 0.5) << "the surface is there again";
  EXPECT_GE(rig.loop.local_model().contact_port().least_J(), -1e-6);
}

TEST(PauseTest, ResumedAtOnceTheForceFadesFirst) {
  Paused rig;
  rig.loop.pause(true);
  rig.run(5);
  rig.loop.pause(false);
  rig.run(300);
  EXPECT_LE(rig.largest_step_N, kJump_N);
  EXPECT_EQ(rig.force_N(), 0) << "not gripped anew";
  EXPECT_NE(rig.last.state, LoopState::kPaused);
}

TEST(PauseTest, AFaultThatIsResetWhilePausedGivesNoForce) {
  Paused rig;
  rig.loop.pause(true);
  rig.run(200);
  rig.remote.on_answer = [](contact::ContactSet& set) { set.contacts[0].depth_m = std::nan(""); };
  rig.run(50);
  EXPECT_EQ(rig.last.state, LoopState::kFault);
  rig.remote.on_answer = nullptr;
  rig.loop.reset_fault();
  rig.grip_anew();
  rig.run(300);
  EXPECT_EQ(rig.last.state, LoopState::kPaused);
  EXPECT_EQ(rig.force_N(), 0);
  rig.loop.pause(false);
  rig.run(10);
  EXPECT_NE(rig.last.state, LoopState::kPaused) << "and it goes on when asked";
  rig.grip_anew();
  rig.device.hold_at({rig.device.true_pose().R, rig.device.true_pose().p - glm::dvec3(0, 0, 0.01)});
  rig.run(1500);
  EXPECT_GT(rig.force_N(), 0.5);
}

TEST(PauseTest, AResumeDoesNotResetAFault) {
  Paused rig;
  rig.loop.pause(true);
  rig.run(200);
  rig.remote.on_answer = [](contact::ContactSet& set) { set.contacts[0].depth_m = std::nan(""); };
  rig.run(50);
  rig.remote.on_answer = nullptr;
  rig.loop.pause(false);
  rig.grip_anew();
  rig.run(300);
  EXPECT_EQ(rig.last.state, LoopState::kFault);
  EXPECT_EQ(rig.force_N(), 0);
}

TEST(PauseTest, RecentredTheToolIsBackAtItsStartAndTheHandHoldsItThereFromWhereItIs) {
  Paused rig;
  ASSERT_GT(rig.from_start_m(), 0.005);
  rig.loop.pause(true);
  rig.loop.recentre();
  rig.run(200);
  rig.largest_step_N = 0;
  rig.run(3000);
  EXPECT_LT(rig.from_start_m(), 5e-4);
  EXPECT_EQ(rig.largest_step_N, 0) << "nothing of it is felt";
  const spatial::Pose X_WHand = rig.device.true_pose();
  rig.loop.pause(false);
  rig.grip_anew();
  rig.run(1000);
  EXPECT_EQ(rig.guard.stage(), Stage::kEnabled);
  EXPECT_LT(rig.force_N(), 0.1);
  EXPECT_LT(rig.from_start_m(), 1e-3);
  rig.device.hold_at({X_WHand.R, X_WHand.p + glm::dvec3(0.01, 0, 0)});
  rig.run(1000);
  EXPECT_NEAR(rig.last.X_WT.p.x - rig.X_WT_start.p.x, rig.device.true_pose().p.x - X_WHand.p.x, 1e-3);
  EXPECT_LE(rig.largest_step_N, kJump_N);
}

TEST(PauseTest, NotPausedNothingIsRecentred) {
  Paused rig;
  rig.loop.recentre();
  rig.run(500);
  rig.loop.pause(true);
  rig.run(2000);
  EXPECT_GT(rig.from_start_m(), 0.005);
}

}  // namespace
}  // namespace farfeel::devices
