// libevdev, EVIOCSFF and the node's reads, writes and poll() as they are, on an emulated joystick: through the driver.

#include "master_station/devices/channel/evdev_channel.h"

#include <gtest/gtest.h>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/driver/pid_joystick_driver.h"
#include "tests/support/devices/emulated_evdev.h"
#include "tests/support/devices/under_umockdev.h"

using namespace farfeel;
using namespace farfeel::devices;
using namespace farfeel::test_support;

namespace {

struct EvdevChannelTest : testing::Test {
  void SetUp() override {
    if (const std::string why = why_not_under_umockdev(); !why.empty()) GTEST_SKIP() << why;
    mock = std::make_unique<MockDevices>();
    node = std::make_unique<EmulatedEvdev>(*mock, device, 3);
    const auto found = find_force_feedback(node->sysfs());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].path, node->path());
    EXPECT_EQ(found[0].serial, "E1");
    auto channel = open_evdev(node->path());
    ASSERT_TRUE(channel) << channel.error();
    auto opened =
        PidJoystickDriver::open(std::move(*channel), {.model = {}, .serial = {}, .path = node->path(), .trouble = {}});
    ASSERT_TRUE(opened) << opened.error().message;
    driver = std::move(*opened);
    ASSERT_EQ(step({}, false), Stage::kReady) << driver->advice();
  }
  void TearDown() override {
    driver.reset();
    node.reset();
    mock.reset();
  }

  Stage step(const glm::dvec3& force, bool is_force_on = true) {
    return driver->step(realtime::monotonic_now_ns() + 1'000'000,
                        {.time_ns = realtime::monotonic_now_ns(),
                         .F_hand_B = {.torque_Nm = {}, .force_N = force},
                         .opening = 1,
                         .is_force_on = is_force_on,
                         .is_light_on = false},
                        newest);
  }
  /// Steps until the pose is there; false: it never was.
  bool comes_to(const glm::dvec3& p_m, const glm::dvec3& force, bool is_force_on = true) {
    const std::int64_t end_ns = realtime::monotonic_now_ns() + 10'000'000'000;
    while (realtime::monotonic_now_ns() < end_ns && step(force, is_force_on) == Stage::kReady)
      if (glm::length(newest.X_BD.p - p_m) < 1e-4 && glm::length(newest.V_BD_B.linear_m_s) < 1e-3) return true;
    return false;
  }

  ForceJoystickEmulator device{2};
  std::unique_ptr<MockDevices> mock;
  std::unique_ptr<EmulatedEvdev> node;
  std::unique_ptr<Driver> driver;
  Sample newest;
};

TEST_F(EvdevChannelTest, ForceReachesTheReading) {
  EXPECT_TRUE(comes_to({0.02, 0.012, 0}, {0.5, 0.3, 0}));  // 4 N at full level against 100 N/m
  EXPECT_TRUE(comes_to({0, 0, 0}, {}, false));
  EXPECT_EQ(node->with_device([&] { return device.autocenter(); }), 0);
  EXPECT_EQ(node->with_device([&] { return device.gain(); }), 1);
}

TEST_F(EvdevChannelTest, ButtonsAndDroppedEventsComeThrough) {
  node->with_device([&] { device.press(BTN_TRIGGER + 1, true); });
  const std::int64_t end_ns = realtime::monotonic_now_ns() + 5'000'000'000;
  while (newest.buttons == 0 && realtime::monotonic_now_ns() < end_ns) step({}, false);
  EXPECT_EQ(newest.buttons, 2U);
  node->with_device([&] { device.push(2, 1); });
  node->overflow();
  EXPECT_TRUE(comes_to({0.02, -0.01, 0}, {}, false));
}

TEST_F(EvdevChannelTest, UnpluggedIsAbsent) {
  EXPECT_TRUE(comes_to({0.02, 0, 0}, {0.5, 0, 0}));
  node->unplug();
  const std::int64_t end_ns = realtime::monotonic_now_ns() + 5'000'000'000;
  while (step({0.5, 0, 0}) != Stage::kAbsent && realtime::monotonic_now_ns() < end_ns) {
  }
  EXPECT_EQ(newest.stage, Stage::kAbsent);
}

TEST_F(EvdevChannelTest, EndsWithoutForce) {
  EXPECT_TRUE(comes_to({0.02, 0, 0}, {0.5, 0, 0}));
  driver.reset();
  EXPECT_EQ(node->with_device([&] { return device.effect_force_N()[0]; }), 0);
}

}  // namespace

int main(int argc, char** argv) {
  enter_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
