#include "master_station/devices/driver/wooden_haptics_driver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "master_station/devices/model/device_model.h"
#include "tests/support/devices/emulated_hid_channel.h"
#include "tests/support/devices/wooden_haptics_emulator.h"
#include "tests/support/realtime_guard.h"

using namespace farfeel;
using namespace farfeel::devices;
using test_support::EmulatedHidChannel;
using test_support::ReportFault;
using test_support::TestClock;
using test_support::WoodenHapticsEmulator;

namespace {

constexpr std::int64_t kTick_ns = 1'000'000;
const Eigen::Vector3d kNeutral_rad(0, 0, std::numbers::pi / 2);
constexpr double kHandDeep_N_per_m = 2000;

glm::dvec3 to_glm(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

bool is_without_current(const std::vector<std::byte>& packet) {
  // Command 0 and no current; or command 1, which gives none whatever it says.
  return packet.size() == 15 &&
         (packet[7] == std::byte{1} ||
          std::all_of(packet.begin(), packet.end(), [](std::byte b) { return b == std::byte{0}; }));
}

struct WoodenHapticsDriverTest : testing::Test {
  WoodenHapticsEmulator device;
  EmulatedHidChannel* channel = nullptr;
  std::unique_ptr<WoodenHapticsDriver> driver;
  Command command;
  Sample sample;

  void SetUp() override {
    auto made = std::make_unique<EmulatedHidChannel>(device);
    channel = made.get();
    driver = std::make_unique<WoodenHapticsDriver>(std::move(made), FoundDevice{"wooden-haptics", "", "memory", ""},
                                                   codecs::WoodenHapticsArm{}, TestClock::now);
  }
  Stage tick() {
    const std::int64_t deadline_ns = TestClock::time_ns + kTick_ns;
    const Stage stage = driver->step(deadline_ns, command, sample);
    EXPECT_LE(TestClock::time_ns, deadline_ns);
    EXPECT_EQ(stage, sample.stage);
    TestClock::time_ns = deadline_ns;
    device.advance_to(deadline_ns);
    return stage;
  }
  Stage run_ms(int ms) {
    Stage stage = Stage::kAbsent;
    for (int i = 0; i < ms; ++i) stage = tick();
    return stage;
  }
  void hold_at(const Eigen::Vector3d& angles_rad) {
    device.put_at(angles_rad);
    device.grasp(device.handle_B_m(), kHandDeep_N_per_m);
  }
  void make_ready() {
    run_ms(10);
    hold_at(kNeutral_rad);
    ASSERT_EQ(run_ms(2100), Stage::kReady) << driver->advice();
  }
  void ask_for(const glm::dvec3& F_N) {
    command.is_force_on = true;
    command.F_hand_B.force_N = F_N;
  }
};

TEST_F(WoodenHapticsDriverTest, WaitsToBePutIntoItsNeutralPose) {
  ask_for({3, 3, 3});
  EXPECT_EQ(run_ms(1), Stage::kHoming);
  device.grasp(device.handle_B_m());
  EXPECT_EQ(run_ms(5000), Stage::kHoming) << "still, but nobody moved it";
  EXPECT_NE(driver->advice().find("neutral pose"), std::string::npos);
  hold_at(kNeutral_rad);
  EXPECT_EQ(run_ms(1900), Stage::kHoming) << "not still for long enough";
  for (const auto& packet : channel->written()) ASSERT_TRUE(is_without_current(packet)) << "force before ready";
  command.is_force_on = false;
  EXPECT_EQ(run_ms(200), Stage::kReady);
  EXPECT_TRUE(driver->advice().empty());
  EXPECT_LT(glm::length(sample.X_BD.p - glm::dvec3(0, -0.025, 0.205)), 2e-3);
}

TEST_F(WoodenHapticsDriverTest, TheBoardsButtonHomesAtOnce) {
  hold_at(kNeutral_rad);
  run_ms(10);
  device.press_button();
  EXPECT_EQ(run_ms(400), Stage::kReady);
  // And anew later, when the arm had been elsewhere.
  device.grasp(device.handle_B_m() - Eigen::Vector3d(0, 0, 0.05));
  run_ms(300);
  ask_for({0, 0, 1});
  run_ms(50);
  device.press_button();
  channel->forget_written();
  run_ms(3);
  EXPECT_EQ(sample.stage, Stage::kHoming);
  EXPECT_EQ(sample.X_BD, spatial::Pose{});
  run_ms(150);
  ASSERT_GT(channel->written().size(), 100U);
  for (std::size_t i = 3; i < channel->written().size(); ++i) EXPECT_TRUE(is_without_current(channel->written()[i]));
}

TEST_F(WoodenHapticsDriverTest, AButtonThatIsHeldOnAfterHomingHomesNowhereElse) {
  hold_at(kNeutral_rad);
  run_ms(10);
  for (int i = 0; i < 400 && sample.stage != Stage::kReady; ++i) {
    device.press_button();
    run_ms(1);
  }
  ASSERT_EQ(sample.stage, Stage::kReady);
  for (int i = 0; i < 100; ++i) {
    device.press_button();
    EXPECT_EQ(run_ms(1), Stage::kReady);
  }
  run_ms(10);
  device.grasp(device.handle_B_m() - Eigen::Vector3d(0, 0, 0.15));
  EXPECT_EQ(run_ms(1000), Stage::kReady) << driver->advice();
  EXPECT_LT(glm::length(sample.X_BD.p - to_glm(device.handle_B_m())), 2e-3);
  channel->forget_written();
  ask_for({0, 0, 1});
  run_ms(10);
  EXPECT_FALSE(is_without_current(channel->written().back())) << "the press is over";
}

TEST_F(WoodenHapticsDriverTest, AButtonThatIsHeldOnHidesNoSlowHand) {
  hold_at(kNeutral_rad);
  run_ms(10);
  const Eigen::Vector3d home_B_m = device.handle_B_m();
  for (int ms = 0; ms < 4400; ++ms) {
    device.press_button();
    if (ms >= 400) device.grasp(home_B_m - Eigen::Vector3d(0, 0, 0.01 * (ms - 400) * 1e-3), kHandDeep_N_per_m);
    run_ms(1);
  }
  EXPECT_EQ(sample.stage, Stage::kReady) << driver->advice();
  EXPECT_LT(device.handle_B_m().z(), home_B_m.z() - 0.035);
  EXPECT_LT(glm::length(sample.X_BD.p - to_glm(device.handle_B_m())), 2e-3);
}

TEST_F(WoodenHapticsDriverTest, TellsWhereTheHandleIs) {
  make_ready();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> turn(-0.3, 0.3);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d from = device.angles_rad(),
                          to = kNeutral_rad + Eigen::Vector3d(turn(random), turn(random), turn(random));
    for (int ms = 0; ms < 200; ++ms) {  // as a hand moves it
      device.put_at(from + (to - from) * ms / 200);
      ASSERT_EQ(tick(), Stage::kReady);
      // A count is 0.26 mrad of a body: 0.1 mm at the handle; and the answer is a tick old.
      ASSERT_LT(glm::length(sample.X_BD.p - to_glm(device.handle_B_m())), 2e-3);
    }
  }
  EXPECT_GE(sample.polled_ns, TestClock::time_ns - 2 * kTick_ns);
  EXPECT_EQ(sample.buttons, 0U);
}

TEST_F(WoodenHapticsDriverTest, EstimatesItsVelocity) {
  make_ready();
  const Eigen::Vector3d before = device.handle_B_m();
  double t_s = 0;
  for (int ms = 0; ms < 100; ++ms, t_s += 1e-3) {
    device.put_at(kNeutral_rad + Eigen::Vector3d(0.5 * t_s, 0.4 * t_s, 0));
    tick();
  }
  const glm::dvec3 truth = to_glm(device.handle_B_m() - before) / t_s;
  EXPECT_LT(glm::length(sample.V_BD_B.linear_m_s - truth), 0.2 * glm::length(truth));
}

TEST_F(WoodenHapticsDriverTest, PacketsGoOneForOne) {
  make_ready();
  channel->forget_written();
  const std::uint64_t before = sample.reports;
  run_ms(500);
  EXPECT_EQ(channel->written().size(), 500U);
  EXPECT_EQ(sample.reports - before, 500U);
  EXPECT_EQ(device.refused(), 0);
  EXPECT_EQ(device.watchdog_trips(), 0);
}

TEST_F(WoodenHapticsDriverTest, AHandIsPushedWithTheForceThatIsAskedFor) {
  make_ready();
  for (const glm::dvec3& F : {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0.5, 0.5, -1)}) {
    ask_for(F);
    run_ms(300);
    EXPECT_LT(glm::length(to_glm(device.motor_force_B_N()) - F), 0.03);
    // and the hand's spring carries it
    const Eigen::Vector3d rest = device.handle_B_m();
    command.is_force_on = false;
    run_ms(300);
    EXPECT_LT(device.motor_force_B_N().norm(), 1e-9);
    const glm::dvec3 moved = to_glm(rest - device.handle_B_m());
    EXPECT_LT(glm::length(moved - F / kHandDeep_N_per_m), 2e-4);
  }
}

TEST_F(WoodenHapticsDriverTest, AWallHoldsTheHand) {
  make_ready();
  // Half space below z = 200 mm, 300 N/m, soft for 1 ms ticks; the hand pulls 20 mm into it with 100 N/m.
  constexpr double kWall_m = 0.200, kStiffness_N_per_m = 300;
  const Eigen::Vector3d at = device.handle_B_m();
  device.grasp({at.x(), at.y(), kWall_m - 0.020}, 100);
  command.is_force_on = true;
  for (int ms = 0; ms < 3000; ++ms) {
    command.F_hand_B.force_N = {0, 0, std::max(0.0, kStiffness_N_per_m * (kWall_m - sample.X_BD.p.z))};
    ASSERT_EQ(tick(), Stage::kReady);
  }
  // Springs in series: 100 (20 - d) = 300 d.
  EXPECT_NEAR(device.handle_B_m().z(), kWall_m - 0.005, 1e-3);
  EXPECT_LT(device.velocity_B_m_s().norm(), 0.02);
}

TEST_F(WoodenHapticsDriverTest, SilenceIsAFaultWithoutForceUntilItAnswers) {
  make_ready();
  ask_for({0, 0, 1});
  run_ms(50);
  channel->stop_answering(true);
  channel->forget_written();
  EXPECT_EQ(run_ms(22), Stage::kFault);
  EXPECT_FALSE(driver->advice().empty());
  run_ms(400);
  const auto& sent = channel->written();
  ASSERT_GE(sent.size(), 40U) << "asked again each 10 ms";
  for (std::size_t i = 1; i < sent.size(); ++i) EXPECT_TRUE(is_without_current(sent[i])) << i;
  channel->stop_answering(false);
  command.is_force_on = false;  // a guard sees the fault and takes force off
  run_ms(20);
  EXPECT_EQ(sample.stage, Stage::kReady);
}

TEST_F(WoodenHapticsDriverTest, AnAnswerThatCannotBeIsLeftOutAndCostsOnePacketOfForce) {
  make_ready();
  ask_for({0, 0, 1});
  run_ms(50);
  const spatial::Pose before = sample.X_BD;
  const Eigen::Vector3d angles = device.angles_rad();
  device.put_at(angles + Eigen::Vector3d(0, 0, 0.5));
  EXPECT_EQ(tick(), Stage::kReady);
  EXPECT_LT(glm::length(sample.X_BD.p - before.p), 1e-3);
  device.put_at(angles);
  channel->forget_written();
  tick();
  tick();
  ASSERT_EQ(channel->written().size(), 2U);
  EXPECT_TRUE(is_without_current(channel->written()[0]));
  EXPECT_FALSE(is_without_current(channel->written()[1]));
}

TEST_F(WoodenHapticsDriverTest, AnArmThatWasElsewhereAfterwardsIsLost) {
  make_ready();
  channel->stop_answering(true);
  run_ms(30);
  EXPECT_EQ(sample.stage, Stage::kFault);
  channel->stop_answering(false);
  device.put_at(kNeutral_rad + Eigen::Vector3d(0, 0, 3));
  ask_for({1, 1, 1});
  channel->forget_written();
  EXPECT_EQ(run_ms(50), Stage::kFault);
  device.put_at(kNeutral_rad);
  EXPECT_EQ(run_ms(50), Stage::kFault) << "until it is plugged in again";
  EXPECT_NE(driver->advice().find("home"), std::string::npos);
  for (const auto& packet : channel->written()) EXPECT_TRUE(is_without_current(packet));
}

TEST_F(WoodenHapticsDriverTest, TheDevicesOwnWatchdogTurnsMotorsOff) {
  make_ready();
  ask_for({0, 0, 1});
  run_ms(50);
  EXPECT_GT(device.motor_force_B_N().norm(), 0.9);
  TestClock::time_ns += 490'000'000;  // the owner sleeps
  device.advance_to(TestClock::time_ns);
  EXPECT_TRUE(device.are_motors_on());
  TestClock::time_ns += 20'000'000;
  device.advance_to(TestClock::time_ns);
  EXPECT_FALSE(device.are_motors_on());
  EXPECT_EQ(device.watchdog_trips(), 1);
}

TEST_F(WoodenHapticsDriverTest, UnpluggedIsAbsentAtOnce) {
  make_ready();
  channel->unplug();
  EXPECT_EQ(tick(), Stage::kAbsent);
  EXPECT_EQ(tick(), Stage::kAbsent);
}

TEST_F(WoodenHapticsDriverTest, AMuteDeviceIsToldOf) {
  channel->stop_answering(true);
  EXPECT_EQ(run_ms(1100), Stage::kOpening);
  EXPECT_NE(driver->advice().find("does not answer"), std::string::npos);
  channel->stop_answering(false);
  EXPECT_EQ(run_ms(20), Stage::kHoming);
}

TEST_F(WoodenHapticsDriverTest, EndsWithoutForce) {
  make_ready();
  ask_for({0, 0, 1});
  run_ms(50);
  EXPECT_GT(device.motor_force_B_N().norm(), 0.9);
  driver.reset();
  EXPECT_EQ(device.currents_mA(), (std::array<std::int16_t, 3>{}));
}

TEST_F(WoodenHapticsDriverTest, SpoiltAnswersAreFiniteAndLeaveNoForceBehind) {
  for (const ReportFault fault : {ReportFault::kTruncated, ReportFault::kDuplicated, ReportFault::kReordered,
                                  ReportFault::kMutated, ReportFault::kLost}) {
    SetUp();
    device = WoodenHapticsEmulator();
    make_ready();
    ask_for({0.5, -0.5, 1});
    run_ms(50);
    channel->spoil_input(fault);
    bool had_fault = false;
    for (int i = 0; i < 3000; ++i) {
      channel->forget_written();
      const bool was_ready = sample.stage == Stage::kReady;
      tick();
      ASSERT_TRUE(spatial::is_valid(sample.X_BD));
      ASSERT_TRUE(spatial::is_finite(sample.V_BD_B));
      had_fault = had_fault || sample.stage == Stage::kFault;
      for (const auto& packet : channel->written()) {
        ASSERT_EQ(packet.size(), 15U);
        if (!was_ready) {
          ASSERT_TRUE(is_without_current(packet)) << "force in a fault";
        }
      }
    }
    const bool must_fault =
        fault == ReportFault::kTruncated || fault == ReportFault::kLost || fault == ReportFault::kMutated;
    EXPECT_EQ(had_fault, must_fault) << static_cast<int>(fault);
  }
}

TEST_F(WoodenHapticsDriverTest, StalledOutputIsAFaultAndComesBack) {
  make_ready();
  channel->stall_output(true);
  EXPECT_EQ(run_ms(25), Stage::kFault);
  channel->stall_output(false);
  EXPECT_EQ(run_ms(10), Stage::kReady);
}

// What the model's data promises is what the arm can do: in every direction, everywhere in the workspace, below the
// cap.
TEST(WoodenHapticsDriver, TheModelsForceIsThereInAllOfItsWorkspace) {
  const DeviceModel* const model = find_model("wooden-haptics");
  ASSERT_NE(model, nullptr);
  codecs::WoodenHapticsArm arm;
  const int cap_mA = static_cast<int>(1000 * arm.max_current_A);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> share(0, 1), side(-1, 1);
  int poses = 0, greatest_mA = 0;
  while (poses < 2000) {
    const glm::dvec3 angles =
        glm::mix(arm.min_angle_rad, arm.max_angle_rad, glm::dvec3(share(random), share(random), share(random)));
    const glm::dvec3 p = codecs::handle_B_m(arm, angles);
    if (glm::any(glm::lessThan(p, model->workspace_min_B_m)) ||
        glm::any(glm::greaterThan(p, model->workspace_max_B_m))) {
      continue;
    }
    ++poses;
    glm::dvec3 F(side(random), side(random), side(random));
    F *= model->max_force_N / glm::length(F);
    for (const std::int16_t mA : codecs::motor_currents_mA(arm, angles, F)) {
      greatest_mA = std::max(greatest_mA, std::abs(int{mA}));
    }
  }
  EXPECT_LT(greatest_mA, cap_mA);
  EXPECT_GT(greatest_mA, cap_mA * 9 / 10) << "and not much more than that";
}

// Answers from nowhere, without allocation.
class StillChannel final : public HidChannel {
 public:
  Transferred read(std::span<std::byte> report, std::int64_t) noexcept override {
    if (!is_asked_) return {};
    is_asked_ = false;
    std::fill_n(report.begin(), 15, std::byte{0});
    return {ChannelState::kDone, 15};
  }
  Transferred write(std::span<const std::byte> report) noexcept override {
    is_asked_ = true;
    return {ChannelState::kDone, report.size()};
  }
  Transferred get_feature(std::span<std::byte>) noexcept override { return {}; }
  Transferred set_feature(std::span<const std::byte>) noexcept override { return {}; }
  std::span<const std::byte> report_descriptor() const noexcept override { return {}; }
  int descriptor() const noexcept override { return 5; }

 private:
  bool is_asked_ = false;
};

TEST(WoodenHapticsDriver, AStepAllocatesNothing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need these functions themselves";
  WoodenHapticsDriver driver(std::make_unique<StillChannel>(), {});
  Sample sample;
  Command command;
  command.is_force_on = true;
  {
    const test_support::RealtimeGuard guard;
    for (int i = 0; i < 100; ++i) driver.step(0, command, sample);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), 0U) << test_support::RealtimeGuard::first_violation();
  EXPECT_EQ(sample.reports, 100U);
}

TEST(WoodenHapticsDriver, ForceIsTakenOffByOnePacketOfZeros) {
  WoodenHapticsDriver driver(std::make_unique<StillChannel>(), {});
  const auto zero = driver.zero_force();
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->fd, 5);
  EXPECT_EQ(zero->how, ZeroForce::How::kWrite);
  EXPECT_EQ(zero->size, 15U);
  EXPECT_TRUE(std::all_of(zero->bytes.begin(), zero->bytes.end(), [](std::byte b) { return b == std::byte{0}; }));
}

}  // namespace
