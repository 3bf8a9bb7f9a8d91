#include "master_station/devices/driver/pid_joystick_driver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "tests/support/devices/force_joystick_emulator.h"
#include "tests/support/private_folder.h"
#include "tests/support/realtime_guard.h"

namespace farfeel::devices {
namespace {

/// The emulator behind the channel, by the real clock, with faults.
class EmulatedNode final : public EvdevChannel {
 public:
  explicit EmulatedNode(ForceJoystickEmulator& device) : device_(device) {}

  ChannelState read(input_event& event, std::int64_t deadline_ns) noexcept override {
    if (is_gone) return ChannelState::kGone;
    for (;;) {
      device_.advance_to(realtime::monotonic_now_ns());
      if (const auto next = device_.event()) {
        event = *next;
        return ChannelState::kDone;
      }
      if (realtime::monotonic_now_ns() >= deadline_ns) return ChannelState::kNothing;
    }
  }
  ChannelState write(std::uint16_t type, std::uint16_t code, std::int32_t value) noexcept override {
    if (is_gone) return ChannelState::kGone;
    if (refuses_writes) return ChannelState::kStalled;
    device_.advance_to(realtime::monotonic_now_ns());
    device_.write(type, code, value);
    return ChannelState::kDone;
  }
  ChannelState upload(ff_effect& effect) noexcept override {
    if (is_gone) return ChannelState::kGone;
    if (refuses_uploads) return ChannelState::kStalled;
    device_.advance_to(realtime::monotonic_now_ns());
    return device_.upload(effect) == 0 ? ChannelState::kDone : ChannelState::kStalled;
  }
  [[nodiscard]] bool has(std::uint16_t type, std::uint16_t code) const noexcept override {
    return type == EV_FF ? (code == FF_CONSTANT && has_constant_force) || code == FF_GAIN || code == FF_AUTOCENTER
                         : type == EV_ABS && axis(code).has_value();
  }
  [[nodiscard]] std::optional<input_absinfo> axis(std::uint16_t code) const noexcept override {
    if (has_no_range && code == ABS_X) return input_absinfo{};
    if (code > ABS_Y || code >= device_.axes()) return std::nullopt;
    return device_.axis(code);
  }
  [[nodiscard]] int descriptor() const noexcept override { return 77; }

  bool is_gone = false, refuses_uploads = false, refuses_writes = false, has_constant_force = true;
  bool has_no_range = false;

 private:
  ForceJoystickEmulator& device_;
};

class PidJoystick : public ::testing::Test {
 protected:
  void open(int axes) {
    driver_.reset();
    device_.emplace(axes);
    auto node = std::make_unique<EmulatedNode>(*device_);
    node_ = node.get();
    auto driver = PidJoystickDriver::open(
        std::move(node), {.model = "pid-joystick", .serial = "1", .path = "/dev/input/event7", .trouble = {}});
    ASSERT_TRUE(driver) << driver.error().message;
    driver_ = std::move(*driver);
    ASSERT_EQ(step({}, false), Stage::kReady) << driver_->advice();
  }
  Stage step(const glm::dvec3& force_B, bool is_force_on = true) {
    const Command command{.time_ns = realtime::monotonic_now_ns(),
                          .F_hand_B = {.torque_Nm = {1, 1, 1}, .force_N = force_B},
                          .opening = 1,
                          .is_force_on = is_force_on,
                          .is_light_on = false};
    return driver_->step(realtime::monotonic_now_ns() + 1'000'000, command, newest_);
  }
  /// Steps under a force for so long by the clock.
  void hold(const glm::dvec3& force_B, double time_s, bool is_force_on = true) {
    const auto end_ns = realtime::monotonic_now_ns() + static_cast<std::int64_t>(1e9 * time_s);
    while (realtime::monotonic_now_ns() < end_ns) step(force_B, is_force_on);
  }

  std::optional<ForceJoystickEmulator> device_;
  EmulatedNode* node_ = nullptr;
  std::unique_ptr<Driver> driver_;
  Sample newest_;
};

TEST_F(PidJoystick, force_reaches_the_reading_in_both_axes) {
  open(2);
  EXPECT_EQ(device_->gain(), 1);
  EXPECT_EQ(device_->autocenter(), 0);
  for (const glm::dvec3 share : {glm::dvec3(0.5, 0, 0), glm::dvec3(0, 0.5, 0), glm::dvec3(-0.3, -0.4, 0)}) {
    hold(share, 0.5);
    // The emulator's stick: 4 N at full level against 100 N/m.
    EXPECT_LT(glm::length(newest_.X_BD.p - share * (4.0 / 100)), 5e-5) << share.x << " " << share.y;
    EXPECT_LT(glm::length(newest_.deflection.push - share * (4.0 / 100 / 0.04)), 2e-3);
  }
  hold({}, 0.5, false);
  EXPECT_LT(glm::length(newest_.X_BD.p), 5e-5);
  EXPECT_LT(glm::length(newest_.V_BD_B.linear_m_s), 1e-3);
  EXPECT_EQ(newest_.X_BD.R, glm::dquat(1, 0, 0, 0));
}

TEST_F(PidJoystick, one_axis_has_both_signs_and_no_other) {
  open(1);
  for (const double share : {0.5, -0.25}) {
    hold({share, 1, 1}, 0.5);
    EXPECT_NEAR(newest_.X_BD.p.x, share * 0.04, 5e-5);
    EXPECT_EQ(newest_.X_BD.p.y, 0);
  }
}

TEST_F(PidJoystick, force_beyond_the_greatest_is_the_greatest_in_its_direction) {
  open(2);
  hold({300, -400, 0}, 0.02);
  const auto force_N = device_->effect_force_N();
  EXPECT_NEAR(force_N[0], 4 * 0.6, 1e-3);
  EXPECT_NEAR(force_N[1], 4 * 0.8, 1e-3);  // towards the person
}

TEST_F(PidJoystick, a_hand_moves_the_reading) {
  open(2);
  device_->push(2, -1);  // to the right, and away from the person
  hold({}, 0.5, false);
  EXPECT_NEAR(newest_.X_BD.p.x, 0.02, 5e-5);
  EXPECT_NEAR(newest_.X_BD.p.y, 0.01, 5e-5);
  EXPECT_GT(newest_.reports, 0U);
  EXPECT_GT(newest_.time_ns, 0);
  device_->press(BTN_TRIGGER + 3, true);
  step({}, false);
  EXPECT_EQ(newest_.buttons, 8U);
  device_->press(BTN_TRIGGER + 3, false);
  step({}, false);
  EXPECT_EQ(newest_.buttons, 0U);
}

TEST_F(PidJoystick, updates_are_rare_and_zero_is_at_once) {
  open(2);
  const int before = device_->uploads();
  const std::int64_t begin_ns = realtime::monotonic_now_ns();
  int steps = 0;
  for (; steps < 200; ++steps) step({0.3 + 0.001 * steps, 0.2, 0});
  const double periods = double(realtime::monotonic_now_ns() - begin_ns) / double(PidJoystickDriver::kUpdate_ns);
  EXPECT_LE(device_->uploads() - before, periods + 2);
  EXPECT_GT(device_->uploads() - before, 1);
  const int uploads = device_->uploads();
  hold({0.4, 0, 0}, 0.05);
  EXPECT_LE(device_->uploads() - uploads, 1);  // no change, no transfer
  step({}, false);
  EXPECT_EQ(device_->effect_force_N()[0], 0);
  step({0.4, 0, 0});
  step({0, 0, 0});
  EXPECT_EQ(device_->effect_force_N()[0], 0);
}

TEST_F(PidJoystick, the_effect_goes_on_while_it_is_asked_for_and_ends_by_itself) {
  open(2);
  hold({0.5, 0, 0}, 0.35);
  EXPECT_GT(device_->effect_force_N()[0], 1);
  const std::int64_t begin_ns = realtime::monotonic_now_ns();
  device_->advance_to(begin_ns + 90'000'000);
  device_->advance_to(begin_ns + 150'000'000);  // nobody plays it any more
  EXPECT_EQ(device_->effect_force_N()[0], 0);
}

TEST_F(PidJoystick, the_keepers_bytes_stop_the_effect) {
  open(2);
  hold({0.5, 0, 0}, 0.02);
  const auto zero = driver_->zero_force();
  ASSERT_TRUE(zero);
  EXPECT_EQ(zero->fd, 77);
  EXPECT_EQ(zero->how, ZeroForce::How::kWrite);
  ASSERT_EQ(zero->size, sizeof(input_event));
  input_event event;
  std::memcpy(&event, zero->bytes.data(), sizeof event);
  EXPECT_NE(device_->effect_force_N()[0], 0);
  device_->write(event.type, event.code, event.value);
  EXPECT_EQ(device_->effect_force_N()[0], 0);
}

TEST_F(PidJoystick, no_fault_leaves_force_on) {
  const std::pair<const char*, std::function<void(bool)>> faults[] = {
      {"refused uploads", [&](bool is) { node_->refuses_uploads = is; }},
      {"refused writes", [&](bool is) { node_->refuses_writes = is; }}};
  for (const auto& [what, fault] : faults) {
    SCOPED_TRACE(what);
    open(2);
    hold({0.5, 0, 0}, 0.02);
    fault(true);
    Stage stage = Stage::kReady;
    for (int i = 0; i < 300 && stage == Stage::kReady; ++i) stage = step({0.5 + 1e-3 * i, 0, 0});
    EXPECT_EQ(stage, Stage::kFault);
    EXPECT_NE(driver_->advice(), "");
    hold({0.9, 0, 0}, 0.15);
    EXPECT_EQ(device_->effect_force_N()[0], 0) << "its own end at the latest";
    fault(false);
    hold({0.9, 0, 0}, 0.15);
    EXPECT_EQ(newest_.stage, Stage::kFault);  // nobody let go of the force yet
    EXPECT_EQ(device_->effect_force_N()[0], 0);
    hold({}, 0.1, false);
    EXPECT_EQ(newest_.stage, Stage::kReady);
    hold({0.5, 0, 0}, 0.02);
    EXPECT_NEAR(device_->effect_force_N()[0], 2, 1e-3);
  }
}

TEST_F(PidJoystick, unplugged_is_absent) {
  open(2);
  hold({0.5, 0, 0}, 0.02);
  node_->is_gone = true;
  EXPECT_EQ(step({0.5, 0, 0}), Stage::kAbsent);
  EXPECT_EQ(step({0.5, 0, 0}), Stage::kAbsent);
  EXPECT_NE(driver_->advice().find("unplugged"), std::string::npos);
}

TEST_F(PidJoystick, a_command_that_is_not_finite_is_no_force) {
  open(2);
  hold({0.5, 0, 0}, 0.02);
  step({std::numeric_limits<double>::quiet_NaN(), 0, 0});
  EXPECT_EQ(device_->effect_force_N()[0], 0);
  step({0, std::numeric_limits<double>::infinity(), 0});
  EXPECT_EQ(device_->effect_force_N()[1], 0);
}

TEST_F(PidJoystick, ends_without_force) {
  open(2);
  hold({0.5, 0, 0}, 0.02);
  driver_.reset();
  EXPECT_EQ(device_->effect_force_N()[0], 0);
}

// The emulator allocates when its stick moves, so this one's is too heavy to.
TEST_F(PidJoystick, a_step_allocates_nothing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need these functions themselves";
  ForceJoystickEmulator heavy(
      2, {.full_force_N = 4, .mass_kg = 1e9, .stiffness_N_per_m = 100, .damping_Ns_per_m = 4, .travel_m = 0.04});
  const auto driver = PidJoystickDriver::open(std::make_unique<EmulatedNode>(heavy), {});
  ASSERT_TRUE(driver);
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  {
    const test_support::RealtimeGuard guard;
    for (int i = 0; i < 100; ++i)
      (*driver)->step(realtime::monotonic_now_ns() + 1'000'000,
                      {.time_ns = realtime::monotonic_now_ns(),
                       .F_hand_B = {.torque_Nm = {}, .force_N = {0.01 * i, 0.2, 0}},
                       .opening = 1,
                       .is_force_on = i > 0,
                       .is_light_on = false},
                      newest_);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations() - before, 0U) << test_support::RealtimeGuard::first_violation();
  EXPECT_GT(heavy.plays(), 0);
}

TEST_F(PidJoystick, what_lacks_force_or_range_is_refused) {
  ForceJoystickEmulator device(2);
  const auto refusal = [&](const std::function<void(EmulatedNode&)>& change) {
    auto node = std::make_unique<EmulatedNode>(device);
    change(*node);
    const auto driver = PidJoystickDriver::open(std::move(node), {});
    return driver ? std::string() : driver.error().message;
  };
  EXPECT_NE(refusal([](EmulatedNode& node) { node.has_constant_force = false; }).find("constant force"),
            std::string::npos);
  EXPECT_NE(refusal([](EmulatedNode& node) { node.has_no_range = true; }).find("range"), std::string::npos);
}

TEST(FindForceFeedback, reads_sysfs) {
  const test_support::PrivateFolder folder;
  const std::filesystem::path root = folder.path();
  const auto node = [&](const std::string& name, const std::string& ff, const std::string& abs) {
    const auto device = root / "class" / name / "device";
    std::filesystem::create_directories(device / "capabilities");
    std::ofstream(device / "capabilities/ff") << ff << "\n";
    std::ofstream(device / "capabilities/abs") << abs << "\n";
    std::ofstream(device / "name") << "Stick " << name << "\n";
    std::ofstream(device / "uniq") << "\n";
    std::ofstream(device / "phys") << "usb-0000:00:14.0-1/input0\n";
  };
  node("event1", "0", "3");              // a joystick without force
  node("event2", "300040000 0", "3");    // constant force is bit 0x52: bit 18 of the second word
  node("event3", "107030000 0", "0");    // rumble, no axis
  node("event4", "300040000 0", "100");  // a wheel
  node("mouse0", "300040000 0", "3");
  std::filesystem::create_directories(root / "input");
  std::ofstream(root / "input/event2");
  const auto found = find_force_feedback(root / "class", root / "input");
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].path, (root / "input/event2").string());
  EXPECT_EQ(found[0].trouble, "");
  EXPECT_EQ(found[0].serial, "usb-0000:00:14.0-1/input0");
  EXPECT_NE(found[1].trouble.find("Stick event4"), std::string::npos);  // there is no such node
  EXPECT_TRUE(find_force_feedback("/nowhere", "/nowhere").empty());
  EXPECT_FALSE(open_evdev("/dev/null"));
}

}  // namespace
}  // namespace farfeel::devices
