// The driver against the emulated Falcon in memory, in simulated time: every state, and every way to break the bytes.
#include "master_station/devices/driver/falcon_driver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <tuple>
#include <vector>

#include "tests/support/devices/falcon_in_memory.h"
#include "tests/support/realtime_guard.h"

namespace farfeel::devices {
namespace {

using test_support::FalconEmulator, test_support::FalconEmulatorSettings, test_support::FalconFault,
    test_support::FalconInMemory;

constexpr std::int64_t kMs = 1'000'000;

/// A boot stream as large as the device's own: nobody's firmware.
std::vector<std::byte> made_up_firmware() {
  std::vector<std::byte> bytes(22, std::byte{0});
  bytes[0] = std::byte{0xaa}, bytes[1] = std::byte{0x08};
  for (int block = 0; block < 4; ++block) {
    constexpr unsigned kWords = 1000;
    bytes.push_back(static_cast<std::byte>(kWords & 255U));
    bytes.push_back(static_cast<std::byte>(kWords >> 8U));
    for (unsigned i = 0; i < 4 + 2 * kWords; ++i) bytes.push_back(static_cast<std::byte>(7 * i + 3));
  }
  bytes.insert(bytes.end(), 2, std::byte{0});
  return bytes;
}

/// A Falcon, its driver, and an owner who steps it each millisecond.
struct Station {
  explicit Station(const FalconEmulatorSettings& settings, std::vector<std::byte> firmware = {}) : emulator(settings) {
    plug_in(std::move(firmware));
  }
  void plug_in(std::vector<std::byte> firmware = {}) {
    driver = std::make_unique<FalconDriver>(FoundDevice{.model = "falcon", .serial = "1", .path = "", .trouble = ""},
                                            std::make_unique<FalconInMemory>(emulator, now_ns), std::move(firmware),
                                            [this] { return now_ns; });
  }
  Stage step() {
    const std::int64_t deadline_ns = now_ns + kMs;
    const Stage stage = driver->step(deadline_ns, command, sample);
    EXPECT_EQ(stage, sample.stage);
    EXPECT_TRUE(std::isfinite(glm::length(sample.X_BD.p)) && std::isfinite(glm::length(sample.V_BD_B.linear_m_s)));
    now_ns = std::max(now_ns, deadline_ns);
    emulator.advance(now_ns);
    return stage;
  }
  /// The stage that it ends in.
  Stage step_until(Stage wanted, int most_ms) {
    Stage stage = step();
    for (int i = 0; i < most_ms && stage != wanted; ++i) stage = step();
    return stage;
  }
  void step_for(int ms) {
    for (int i = 0; i < ms; ++i) (void)step();
  }
  void hold(const glm::dvec3& p_F, double stiffness = 2000) {
    emulator.set_hand(
        {.target_F_m = p_F, .stiffness_N_per_m = stiffness, .damping_Ns_per_m = 40, .force_F_N = {0, 0, 0}});
  }
  /// As the advice says: out, then in, then to the middle.
  void home() {
    hold({0, 0, 0.165});
    step_for(400);
    hold({0, 0, 0.085});
    step_for(400);
    hold({0, 0, 0.12});
    step_for(400);
  }
  void push(const glm::dvec3& force_B_N) {
    command.is_force_on = true;
    command.F_hand_B.force_N = force_B_N;
  }

  std::int64_t now_ns = 1'000'000'000;
  FalconEmulator emulator;
  std::unique_ptr<FalconDriver> driver;
  Command command;
  Sample sample;
};

constexpr FalconEmulatorSettings kRuns{.has_firmware = true, .is_homed = true, .mechanics = {}};

bool is_still(const FalconEmulator& emulator) {
  return emulator.motors() == std::array<std::int16_t, 3>{};
}

TEST(FalconDriver, comes_from_power_on_to_a_force) {
  Station station({.mechanics = {}}, made_up_firmware());
  EXPECT_EQ(station.step(), Stage::kOpening);
  EXPECT_EQ(station.step_until(Stage::kFirmware, 500), Stage::kFirmware);
  EXPECT_NE(station.driver->advice().find("loaded"), std::string::npos);
  EXPECT_EQ(station.step_until(Stage::kHoming, 10'000), Stage::kHoming);
  EXPECT_TRUE(station.emulator.is_running());
  EXPECT_EQ(station.emulator.loadings(), 1U);
  station.step_for(500);
  EXPECT_EQ(station.sample.stage, Stage::kHoming) << "nobody moved it";
  EXPECT_EQ(station.emulator.lights(), codecs::kFalconRed);
  EXPECT_NE(station.driver->advice().find("pull"), std::string::npos);
  station.push({1, 0, 0});
  station.home();
  EXPECT_EQ(station.sample.stage, Stage::kReady);
  EXPECT_EQ(station.driver->advice(), "");

  station.command = {};
  station.step_for(10);
  EXPECT_TRUE(is_still(station.emulator));
  EXPECT_EQ(station.emulator.lights(), codecs::kFalconBlue);
  const glm::dvec3 force_B(1.5, -2, 1);
  station.push(force_B);
  station.step_for(300);
  const glm::dvec3 force_F = station.emulator.mechanism().motor_force_F_N();
  EXPECT_NEAR(force_F.x, force_B.x, 0.02);
  EXPECT_NEAR(force_F.z, -force_B.y, 0.02);  // away from the person is into the device
  EXPECT_NEAR(force_F.y, force_B.z, 0.02);
  EXPECT_EQ(station.emulator.lights(), codecs::kFalconGreen);
  station.command.is_force_on = false;
  station.step_for(2);
  EXPECT_TRUE(is_still(station.emulator));
}

TEST(FalconDriver, tells_where_the_grip_is_and_how_fast) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  double worst_m = 0, worst_m_s = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    const double t = ms * 1e-3;
    station.hold({0.03 * std::sin(6 * t), 0.02 * std::sin(4 * t), 0.12 + 0.03 * std::sin(5 * t)}, 4000);
    (void)station.step();
    if (ms < 300) continue;
    const glm::dvec3 p = station.emulator.mechanism().position_F_m() - codecs::kFalconMiddle_F_m;
    const glm::dvec3 v = station.emulator.mechanism().velocity_F_m_s();
    worst_m = std::max(worst_m, glm::distance(station.sample.X_BD.p, {p.x, -p.z, p.y}));
    worst_m_s = std::max(worst_m_s, glm::distance(station.sample.V_BD_B.linear_m_s, {v.x, -v.z, v.y}));
    EXPECT_EQ(station.sample.stage, Stage::kReady);
    EXPECT_LE(station.now_ns - station.sample.time_ns, 2 * kMs);
  }
  std::printf("position off by %.3g mm, velocity by %.3g m/s at most, of 0.3 m/s\n", 1e3 * worst_m, worst_m_s);
  EXPECT_LT(worst_m, 0.8e-3);  // 2 ms late at 0.3 m/s, and half a step of the encoders
  EXPECT_LT(worst_m_s, 0.06);  // the filter is 4 ms late; a step of the encoders is 10 mm/s behind it
  // One packet a millisecond, and one answer to each.
  EXPECT_GT(station.sample.reports, 1900U);
  EXPECT_EQ(station.driver->counts().implausible, 0U);
  EXPECT_EQ(station.driver->counts().discarded_bytes, 0U);
}

TEST(FalconDriver, a_wall_holds_the_hand_back_in_every_direction) {
  constexpr double kWall_N_per_m = 500, kPush_N = 3;
  for (const glm::dvec3 inward : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0),
                                  glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1), glm::normalize(glm::dvec3(1, -2, 3))}) {
    Station station(kRuns);
    station.hold({0, 0, 0.12});
    ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
    station.step_for(300);
    // The hand lets go and pushes; the wall's plane goes through the middle.
    const glm::dvec3 push_F = kPush_N * glm::dvec3(inward.x, inward.z, -inward.y);
    station.emulator.set_hand(
        {.target_F_m = {0, 0, 0.12}, .stiffness_N_per_m = 0, .damping_Ns_per_m = 10, .force_F_N = push_F});
    for (int ms = 0; ms < 1500; ++ms) {
      const double depth_m = glm::dot(station.sample.X_BD.p, inward);
      station.push(depth_m > 0 ? -kWall_N_per_m * depth_m * inward : glm::dvec3(0));
      (void)station.step();
    }
    EXPECT_EQ(station.sample.stage, Stage::kReady);
    EXPECT_NEAR(glm::dot(station.sample.X_BD.p, inward), kPush_N / kWall_N_per_m, 2e-4);
    EXPECT_LT(glm::length(station.emulator.mechanism().velocity_F_m_s()), 0.01);
  }
}

TEST(FalconDriver, tells_buttons) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  for (const unsigned buttons : {1U, 2U, 4U, 8U, 15U, 0U}) {
    station.emulator.press(static_cast<std::uint8_t>(buttons));
    station.step_for(5);
    EXPECT_EQ(station.sample.buttons, buttons);
  }
}

TEST(FalconDriver, firmware_that_is_flaky_is_loaded_all_the_same) {
  Station station({.deaf_hellos = 7, .wrong_echoes = 3, .lost_echoes = 3, .mechanics = {}}, made_up_firmware());
  EXPECT_EQ(station.step_until(Stage::kHoming, 60'000), Stage::kHoming);
  EXPECT_EQ(station.emulator.loadings(), 7U);
}

TEST(FalconDriver, firmware_that_cannot_be_loaded_is_told_and_tried_again) {
  Station station({.wrong_echoes = FalconLoader::kMostLoadings, .mechanics = {}}, made_up_firmware());
  EXPECT_EQ(station.step_until(Stage::kFault, 60'000), Stage::kFault);
  EXPECT_NE(station.driver->advice().find("echoed another byte"), std::string::npos) << station.driver->advice();
  EXPECT_EQ(station.step_until(Stage::kHoming, 60'000), Stage::kHoming);
  EXPECT_EQ(station.emulator.moving_packets(), 0U);
}

TEST(FalconDriver, a_device_without_power_is_told) {
  Station station({.deaf_hellos = 1'000'000, .mechanics = {}}, made_up_firmware());
  EXPECT_EQ(station.step_until(Stage::kFault, 100'000), Stage::kFault);
  EXPECT_NE(station.driver->advice().find("power supply"), std::string::npos);
}

TEST(FalconDriver, without_a_file_it_says_how_to_get_one) {
  Station station({.mechanics = {}});
  EXPECT_EQ(station.step_until(Stage::kFirmware, 1000), Stage::kFirmware);
  station.step_for(3000);
  EXPECT_EQ(station.sample.stage, Stage::kFirmware);
  EXPECT_NE(station.driver->advice().find("--firmware FILE"), std::string::npos);
  EXPECT_EQ(station.emulator.loadings(), 0U);
  station.emulator.set_fault(FalconFault::kUnplugged);
  EXPECT_EQ(station.step_until(Stage::kAbsent, 10), Stage::kAbsent);
}

TEST(FalconDriver, firmware_from_before_is_found) {
  Station station({.has_firmware = true, .mechanics = {}}, made_up_firmware());
  EXPECT_EQ(station.step_until(Stage::kHoming, 300), Stage::kHoming);
  EXPECT_EQ(station.emulator.loadings(), 0U);
}

TEST(FalconDriver, silence_of_20_ms_is_a_fault_without_force_and_ends) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.push({2, 0, 0});
  station.step_for(50);
  EXPECT_FALSE(is_still(station.emulator));
  station.emulator.set_fault(FalconFault::kSilent);  // it hears, but says nothing
  int ms = 0;
  for (; !is_still(station.emulator) && ms < 100; ++ms) (void)station.step();
  EXPECT_LE(ms, 23);
  EXPECT_EQ(station.sample.stage, Stage::kFault);
  EXPECT_NE(station.driver->advice().find("does not answer"), std::string::npos);
  const std::uint64_t moved = station.emulator.moving_packets();
  station.step_for(500);
  EXPECT_EQ(station.emulator.moving_packets(), moved);
  EXPECT_EQ(station.sample.stage, Stage::kFault);
  station.emulator.set_fault(FalconFault::kNone);
  station.command = {};
  EXPECT_EQ(station.step_until(Stage::kReady, 200), Stage::kReady);
}

TEST(FalconDriver, a_device_that_lost_its_power_begins_anew) {
  Station station(kRuns, made_up_firmware());
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.push({2, 0, 0});
  station.step_for(50);
  station.emulator.lose_power();  // its USB chip lives from the bus
  EXPECT_EQ(station.step_until(Stage::kFault, 30), Stage::kFault);
  const std::uint64_t moved = station.emulator.moving_packets();
  EXPECT_EQ(station.step_until(Stage::kFirmware, 5000), Stage::kFirmware);
  EXPECT_EQ(station.step_until(Stage::kHoming, 10'000), Stage::kHoming);
  EXPECT_EQ(station.emulator.moving_packets(), moved);
}

TEST(FalconDriver, a_stalled_endpoint_is_a_fault) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.push({2, 0, 0});
  station.step_for(10);
  station.emulator.set_fault(FalconFault::kStalled);
  EXPECT_EQ(station.step_until(Stage::kFault, 30), Stage::kFault);
  EXPECT_GT(station.driver->counts().stalls, 0U);
  station.emulator.set_fault(FalconFault::kNone);
  const std::uint64_t moved = station.emulator.moving_packets();
  station.step_for(50);
  EXPECT_EQ(station.emulator.moving_packets(), moved);
  EXPECT_EQ(station.step_until(Stage::kReady, 200), Stage::kReady);
}

TEST(FalconDriver, unplugged_is_absent_for_good) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.emulator.set_fault(FalconFault::kUnplugged);
  EXPECT_EQ(station.step_until(Stage::kAbsent, 3), Stage::kAbsent);
  station.emulator.set_fault(FalconFault::kNone);
  station.step_for(50);
  EXPECT_EQ(station.sample.stage, Stage::kAbsent);
  station.plug_in();
  EXPECT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
}

TEST(FalconDriver, its_end_takes_force_off) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.push({3, 1, 0});
  station.step_for(50);
  ASSERT_FALSE(is_still(station.emulator));
  station.driver.reset();
  EXPECT_TRUE(is_still(station.emulator));
  EXPECT_EQ(station.emulator.watchdog_took_ns(), 0);
}

TEST(FalconDriver, a_force_that_is_no_number_or_too_great) {
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  station.push({0, nan, 0});
  station.step_for(20);
  EXPECT_TRUE(is_still(station.emulator));
  EXPECT_GT(station.driver->counts().refused_forces, 0U);
  station.hold({0, 0, 0.12}, 20'000);
  station.push({0, 500, 0});
  station.step_for(20);
  EXPECT_GT(station.driver->counts().weaker_forces, 0U);
  for (const std::int16_t value : station.emulator.motors()) EXPECT_LE(std::abs(value), 4096);
}

/// Answers each packet with the same reading.
class SameReply final : public UsbChannel {
 public:
  explicit SameReply(std::int64_t& now_ns) : now_ns_(now_ns) {}
  Transferred control(std::uint8_t, std::uint8_t, std::uint16_t, std::uint16_t) noexcept override {
    return {ChannelState::kDone, 0};
  }
  Transferred control_in(std::uint8_t, std::uint8_t, std::uint16_t, std::uint16_t,
                         std::span<std::byte>) noexcept override {
    return {ChannelState::kStalled, 0};
  }
  Transferred send(std::span<const std::byte> bytes) noexcept override {
    is_asked_ = true;
    return {ChannelState::kDone, bytes.size()};
  }
  Transferred receive(std::span<std::byte> bytes, std::int64_t deadline_ns) noexcept override {
    now_ns_ = std::max(now_ns_, deadline_ns);
    if (!is_asked_) return {};
    is_asked_ = false;
    constexpr std::string_view kReply =
        "\x11\x60<AAPPAAPPAAPP\xb1"
        "A>";  // -256 each, homed
    std::ranges::copy(std::as_bytes(std::span(kReply)), bytes.begin());
    return {ChannelState::kDone, kReply.size()};
  }
  [[nodiscard]] int descriptor() const noexcept override { return 7; }
  [[nodiscard]] std::uint8_t out_endpoint() const noexcept override { return 2; }

 private:
  std::int64_t& now_ns_;
  bool is_asked_ = false;
};

TEST(FalconDriver, allocates_nothing_once_ready_and_tells_the_keeper_how_to_take_force_off) {
  std::int64_t now_ns = 1'000'000'000;
  FalconDriver driver({.model = "falcon", .serial = "", .path = "", .trouble = ""}, std::make_unique<SameReply>(now_ns),
                      {}, [&] { return now_ns; });
  Command command;
  Sample sample;
  EXPECT_FALSE(driver.zero_force()) << "sixteen bytes to a boot loader";
  for (int i = 0; i < 100; ++i) (void)driver.step(now_ns + kMs, command, sample);
  ASSERT_EQ(sample.stage, Stage::kReady);
  EXPECT_NEAR(sample.X_BD.p.x, 0, 1e-9);
  const auto zero = driver.zero_force();
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->fd, 7);
  EXPECT_EQ(zero->endpoint, 2);
  // No force, homing on, red: by hand from the table.
  constexpr std::string_view kZero = "<AAAAAAAAAAAAJA>";
  EXPECT_TRUE(std::ranges::equal(std::span(zero->bytes).first(zero->size), std::as_bytes(std::span(kZero))));

  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc themselves";
  command.is_force_on = true;
  command.F_hand_B.force_N = {1, 2, 3};
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  {
    const test_support::RealtimeGuard guard;
    for (int i = 0; i < 1000; ++i) (void)driver.step(now_ns + kMs, command, sample);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
  EXPECT_EQ(sample.stage, Stage::kReady);
  EXPECT_GT(sample.reports, 1000U);
}

/// Replies broken in every way and by every share: finite throughout, which step() checks; and no motor moves in a step
/// that ended in another stage than ready.
class BrokenReplies : public testing::TestWithParam<std::tuple<FalconFault, double>> {};

TEST_P(BrokenReplies, are_survived) {
  const auto [fault, chance] = GetParam();
  Station station(kRuns);
  ASSERT_EQ(station.step_until(Stage::kReady, 500), Stage::kReady);
  station.hold({0.01, 0, 0.12});
  station.push({2, 1, -1});
  station.step_for(200);
  station.emulator.set_fault(fault, chance);
  int ready_ms = 0;
  double worst_m = 0;
  for (int ms = 0; ms < 3000; ++ms) {
    const std::uint64_t moved = station.emulator.moving_packets();
    const Stage before = station.sample.stage;
    const Stage stage = station.step();
    if (before != Stage::kReady && stage != Stage::kReady) {
      EXPECT_EQ(station.emulator.moving_packets(), moved);
    }
    if (stage != Stage::kReady) continue;
    ++ready_ms;
    const glm::dvec3 p = station.emulator.mechanism().position_F_m() - codecs::kFalconMiddle_F_m;
    worst_m = std::max(worst_m, glm::distance(station.sample.X_BD.p, {p.x, -p.z, p.y}));
  }
  const FalconCounts counts = station.driver->counts();
  std::printf("ready %d of 3000 ms, %lu faults, %lu doubted, %lu bytes dropped, place off by %.2f mm at most\n",
              ready_ms, counts.faults, counts.implausible, counts.discarded_bytes, 1e3 * worst_m);
  EXPECT_LT(worst_m, 0.02);
  station.emulator.set_fault(FalconFault::kNone);
  station.command = {};
  EXPECT_EQ(station.step_until(Stage::kReady, 6000), Stage::kReady) << station.driver->advice();
}

INSTANTIATE_TEST_SUITE_P(Falcon, BrokenReplies,
                         testing::Combine(testing::Values(FalconFault::kTruncated, FalconFault::kDuplicated,
                                                          FalconFault::kReordered, FalconFault::kMutated,
                                                          FalconFault::kGarbage, FalconFault::kSilent,
                                                          FalconFault::kStalled),
                                          testing::Values(0.01, 0.2, 1.0)));

}  // namespace
}  // namespace farfeel::devices
