#include "master_station/devices/driver/space_mouse_driver.h"

#include <gtest/gtest.h>

#include "tests/support/devices/emulated_hid_channel.h"
#include "tests/support/devices/space_mouse_emulator.h"
#include "tests/support/realtime_guard.h"

using namespace farfeel;
using namespace farfeel::devices;
using test_support::EmulatedHidChannel;
using test_support::ReportFault;
using test_support::SpaceMouseEmulator;
using test_support::SpaceMouseReports;
using test_support::TestClock;

namespace {

constexpr std::int64_t kTick_ns = 1'000'000;

struct SpaceMouseDriverTest : testing::TestWithParam<SpaceMouseReports> {
  SpaceMouseEmulator device{GetParam()};
  EmulatedHidChannel* channel = nullptr;
  std::unique_ptr<SpaceMouseDriver> driver;
  Command command;
  Sample sample;

  void SetUp() override {
    auto made = std::make_unique<EmulatedHidChannel>(device);
    channel = made.get();
    driver = std::make_unique<SpaceMouseDriver>(std::move(made), FoundDevice{"spacemouse", "", "memory", ""},
                                                TestClock::now);
  }
  Stage run_ms(int ms) {
    Stage stage = Stage::kAbsent;
    for (int i = 0; i < ms; ++i) stage = tick();
    return stage;
  }
  Stage tick() {
    const std::int64_t deadline_ns = TestClock::time_ns + kTick_ns;
    const Stage stage = driver->step(deadline_ns, command, sample);
    EXPECT_LE(TestClock::time_ns, deadline_ns);
    TestClock::time_ns = deadline_ns;
    return stage;
  }
};

INSTANTIATE_TEST_SUITE_P(Layouts, SpaceMouseDriverTest,
                         testing::Values(SpaceMouseReports::kSplit, SpaceMouseReports::kCombined),
                         [](const auto& p) { return p.param == SpaceMouseReports::kSplit ? "split" : "combined"; });

TEST_P(SpaceMouseDriverTest, AllSixAxesArriveInTheBaseFrame) {
  sample.opening = 7;
  EXPECT_EQ(tick(), Stage::kReady);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(0));
  // right, towards the person, down; about x, about the axis towards the person, about the one down
  device.deflect({350, 175, 70, -350, 35, -70});
  run_ms(20);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(1, -0.5, -0.2));
  EXPECT_EQ(sample.deflection.turn, glm::dvec3(-1, -0.1, 0.2));
  EXPECT_EQ(sample.opening, 7U) << "that is the owner's";
  EXPECT_EQ(sample.X_BD, spatial::Pose{});
  device.deflect({});
  run_ms(20);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(0));
  EXPECT_EQ(sample.deflection.turn, glm::dvec3(0));
}

TEST_P(SpaceMouseDriverTest, SilenceMeansTheLastReport) {
  device.deflect({350, 0, 0, 0, 0, 0});
  run_ms(20);
  channel->stop_answering(true);
  const std::int64_t silent_since_ns = TestClock::time_ns;
  EXPECT_EQ(run_ms(5000), Stage::kReady);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(1, 0, 0));
  EXPECT_LE(sample.time_ns, silent_since_ns);
  EXPECT_GE(sample.polled_ns, TestClock::time_ns - kTick_ns) << "it was there at the last look";
}

TEST_P(SpaceMouseDriverTest, ButtonsAndLight) {
  device.press(0b10);
  run_ms(2);
  EXPECT_FALSE(sample.has_button(0));
  EXPECT_TRUE(sample.has_button(1));
  device.press(0);
  run_ms(2);
  EXPECT_EQ(sample.buttons, 0U);

  EXPECT_FALSE(device.is_lit());
  command.is_light_on = true;
  run_ms(100);
  EXPECT_TRUE(device.is_lit());
  command.is_light_on = false;
  run_ms(100);
  EXPECT_FALSE(device.is_lit());
  EXPECT_EQ(channel->written().size(), 3U) << "one report at the start, and one a change";
  EXPECT_EQ(device.refused(), 0);
}

TEST_P(SpaceMouseDriverTest, APressAndItsReleaseThatWaitTogetherAreTwoSamples) {
  tick();
  for (const std::uint32_t buttons : {1U, 0U, 2U}) {
    device.press(buttons);
    channel->gather();
  }
  for (const std::uint32_t buttons : {1U, 0U, 2U}) {
    tick();
    EXPECT_EQ(sample.buttons, buttons);
  }
}

TEST_P(SpaceMouseDriverTest, ALightThatCannotBeSetIsLeftAlone) {
  channel->stall_output(true);
  command.is_light_on = true;
  EXPECT_EQ(run_ms(100), Stage::kReady);
  channel->stall_output(false);
  run_ms(100);
  EXPECT_TRUE(channel->written().empty()) << "tried three times, then no more";
  command.is_light_on = false;
  run_ms(2);
  EXPECT_EQ(channel->written().size(), 1U);
}

TEST_P(SpaceMouseDriverTest, UnpluggedIsAbsentBeforeTheKernelTellsReaders) {
  device.deflect({350, 0, 0, 0, 0, 0});
  run_ms(100);
  EXPECT_EQ(channel->written().size(), 1U) << "while reports come nobody asks";
  channel->begin_to_unplug();
  EXPECT_EQ(run_ms(20), Stage::kAbsent);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(0));
}

TEST_P(SpaceMouseDriverTest, UnpluggedIsAbsentAtOnceAndAtRest) {
  device.deflect({350, 350, 350, 350, 350, 350});
  device.press(1);
  run_ms(20);
  ASSERT_NE(sample.deflection.push, glm::dvec3(0));
  EXPECT_TRUE(driver->advice().empty());
  channel->unplug();
  EXPECT_EQ(tick(), Stage::kAbsent);
  EXPECT_EQ(sample.stage, Stage::kAbsent);
  EXPECT_EQ(sample.deflection.push, glm::dvec3(0));
  EXPECT_EQ(sample.deflection.turn, glm::dvec3(0));
  EXPECT_EQ(sample.buttons, 0U);
  EXPECT_FALSE(driver->advice().empty());
  EXPECT_EQ(tick(), Stage::kAbsent) << "for good";
}

TEST_P(SpaceMouseDriverTest, SpoiltReportsAreFiniteAndEndInTheTruth) {
  for (const ReportFault fault : {ReportFault::kTruncated, ReportFault::kDuplicated, ReportFault::kReordered,
                                  ReportFault::kMutated, ReportFault::kLost}) {
    channel->spoil_input(fault);
    device.deflect({350, -100, 50, 0, 10, 20});
    for (int i = 0; i < 2000; ++i) {
      ASSERT_EQ(tick(), Stage::kReady);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_LE(std::abs(sample.deflection.push[axis]), 1);
        ASSERT_LE(std::abs(sample.deflection.turn[axis]), 1);
      }
    }
    channel->spoil_input(ReportFault::kNone);
    run_ms(20);
    EXPECT_EQ(sample.deflection.push, glm::dvec3(1, 100 / 350.0, -50 / 350.0));
    device.deflect({});
    run_ms(60);
    EXPECT_EQ(sample.deflection.push, glm::dvec3(0));
  }
}

// The emulator allocates, so what is guarded is a driver whose device has nothing to say.
class QuietChannel final : public HidChannel {
 public:
  Transferred read(std::span<std::byte> report, std::int64_t) noexcept override {
    if (++reads_ % 2 == 0) return {};
    report[0] = std::byte{1};
    std::fill_n(report.begin() + 1, 12, std::byte{0});
    return {ChannelState::kDone, 13};
  }
  Transferred write(std::span<const std::byte> report) noexcept override {
    return {ChannelState::kDone, report.size()};
  }
  Transferred get_feature(std::span<std::byte>) noexcept override { return {}; }
  Transferred set_feature(std::span<const std::byte>) noexcept override { return {}; }
  std::span<const std::byte> report_descriptor() const noexcept override { return {}; }
  int descriptor() const noexcept override { return -1; }

 private:
  int reads_ = 0;
};

TEST(SpaceMouseDriver, AStepAllocatesNothing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need these functions themselves";
  SpaceMouseDriver driver(std::make_unique<QuietChannel>(), {});
  Sample sample;
  Command command;
  {
    const test_support::RealtimeGuard guard;
    for (int i = 0; i < 100; ++i) {
      command.is_light_on = i % 10 == 0;
      driver.step(0, command, sample);
    }
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), 0U) << test_support::RealtimeGuard::first_violation();
  EXPECT_EQ(sample.reports, 100U);
}

}  // namespace
