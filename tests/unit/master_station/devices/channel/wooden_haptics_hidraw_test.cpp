// WoodenHaptics through hidapi's channel, on an emulated node.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <numbers>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/hidapi_channel.h"
#include "master_station/devices/driver/wooden_haptics_driver.h"
#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/space_mouse_emulator.h"
#include "tests/support/devices/under_umockdev.h"
#include "tests/support/devices/wooden_haptics_emulator.h"

using namespace farfeel;
using namespace farfeel::devices;
using namespace farfeel::test_support;

namespace {

constexpr std::int64_t kPatience_ns = 10'000'000'000;

struct WoodenHapticsHidrawTest : testing::Test {
  void SetUp() override {
    if (const std::string why = why_not_under_umockdev(); !why.empty()) GTEST_SKIP() << why;
    mock = std::make_unique<MockDevices>();
  }
  template <typename IsSo>
  bool step_until(Driver& driver, IsSo is_so) {
    const std::int64_t end_ns = realtime::monotonic_now_ns() + kPatience_ns;
    while (realtime::monotonic_now_ns() < end_ns && !is_so()) {
      driver.step(realtime::monotonic_now_ns() + 1'000'000, command, sample);
    }
    return is_so();
  }
  std::unique_ptr<MockDevices> mock;
  Sample sample;
  Command command;
};

TEST_F(WoodenHapticsHidrawTest, FromPluggedInToForceToUnplugged) {
  WoodenHapticsEmulator device;
  EmulatedHidraw node(*mock, device, 0);
  const auto found = kWoodenHapticsFamily.find({});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].model, "wooden-haptics");
  EXPECT_EQ(found[0].serial, "WH0001");
  EXPECT_EQ(found[0].trouble, "");
  auto opened = kWoodenHapticsFamily.open(found[0], {});
  ASSERT_TRUE(opened) << opened.error().message;
  Driver& driver = **opened;
  ASSERT_TRUE(driver.zero_force());
  EXPECT_GE(driver.zero_force()->fd, 0);

  EXPECT_TRUE(step_until(driver, [&] { return sample.stage == Stage::kHoming; }));
  node.with_device([&] {
    device.put_at({0, 0, std::numbers::pi / 2});
    device.grasp(device.handle_B_m(), 2000);
    device.press_button();
  });
  ASSERT_TRUE(step_until(driver, [&] { return sample.stage == Stage::kReady; })) << driver.advice();
  EXPECT_LT(glm::length(sample.X_BD.p - glm::dvec3(0, -0.025, 0.205)), 2e-3);

  command.is_force_on = true;
  command.F_hand_B.force_N = {0.5, -0.5, 1};
  EXPECT_TRUE(step_until(driver, [&] {
    const Eigen::Vector3d F = node.with_device([&] { return device.motor_force_B_N(); });
    return (F - Eigen::Vector3d(0.5, -0.5, 1)).norm() < 0.03;
  }));
  // The keeper's one write, while the driver says nothing.
  const ZeroForce zero = *driver.zero_force();
  EXPECT_EQ(::write(zero.fd, zero.bytes.data(), zero.size), static_cast<ssize_t>(zero.size));
  EXPECT_EQ(node.with_device([&] { return device.motor_force_B_N().norm(); }), 0);

  node.unplug();
  EXPECT_TRUE(step_until(driver, [&] { return sample.stage == Stage::kAbsent; }));
  EXPECT_TRUE(kWoodenHapticsFamily.find({}).empty());
}

// The ids are those of examples: a board that does something else has other reports.
TEST_F(WoodenHapticsHidrawTest, AnotherBoardWithItsIdsIsNone) {
  struct Other final : HidEmulator {
    SpaceMouseEmulator inside{SpaceMouseReports::kSplit};
    HidIdentity identity() const override { return {0x1234, 0x0006, "mbed", ""}; }
    std::span<const std::byte> report_descriptor() const override { return inside.report_descriptor(); }
    void take_output(std::span<const std::byte>, std::int64_t) override {}
    std::size_t give_input(std::span<std::byte>, std::int64_t) override { return 0; }
  } device;
  EmulatedHidraw node(*mock, device, 0);
  EXPECT_EQ(find_hid_devices().size(), 1U);
  EXPECT_TRUE(kWoodenHapticsFamily.find({}).empty());
}

TEST_F(WoodenHapticsHidrawTest, NoPermissionIsTold) {
  WoodenHapticsEmulator device;
  EmulatedHidraw node(*mock, device, 0);
  ASSERT_EQ(::chmod(node.file().c_str(), 0), 0);
  std::vector<FoundDevice> found;
  std::thread([&] {
    respect_permissions();
    found = kWoodenHapticsFamily.find({});
  }).join();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].trouble.find("WoodenHaptics: no permission"), std::string::npos) << found[0].trouble;
}

}  // namespace

int main(int argc, char** argv) {
  enter_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
