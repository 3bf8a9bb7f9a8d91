// hidapi and hidraw's reads, writes and poll() as they are, on an emulated node.

#include "master_station/devices/channel/hidapi_channel.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/driver/space_mouse_driver.h"
#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/space_mouse_emulator.h"
#include "tests/support/devices/under_umockdev.h"

using namespace farfeel;
using namespace farfeel::devices;
using namespace farfeel::test_support;

namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

struct HidapiChannelTest : testing::Test {
  void SetUp() override {
    if (const std::string why = why_not_under_umockdev(); !why.empty()) GTEST_SKIP() << why;
    mock = std::make_unique<MockDevices>();
  }
  std::unique_ptr<MockDevices> mock;
  SpaceMouseEmulator device{SpaceMouseReports::kSplit};
};

std::int64_t in_ns(std::int64_t ns) {
  return realtime::monotonic_now_ns() + ns;
}

TEST_F(HidapiChannelTest, FindsWhatIsThereByIdsAndUsage) {
  EXPECT_TRUE(find_hid_devices().empty());
  SpaceMouseEmulator other(SpaceMouseReports::kCombined);
  EmulatedHidraw first(*mock, device, 3), second(*mock, other, 4);
  auto found = find_hid_devices();
  std::sort(found.begin(), found.end(), [](const FoundHid& a, const FoundHid& b) { return a.path < b.path; });
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].path, "/dev/hidraw3");
  EXPECT_EQ(found[0].vendor, 0x256f);
  EXPECT_EQ(found[0].product, 0xc635);
  EXPECT_EQ(found[0].usage_page, 1);
  EXPECT_EQ(found[0].usage, 8);
  EXPECT_EQ(found[0].serial, "");
  EXPECT_EQ(found[0].trouble, "");
  EXPECT_EQ(found[1].serial, "36A8");
  first.unplug();
  EXPECT_EQ(find_hid_devices().size(), 1U);
}

TEST_F(HidapiChannelTest, ReportsDescriptorAndWaits) {
  EmulatedHidraw node(*mock, device, 0);
  auto channel = HidapiChannel::open(node.path());
  ASSERT_TRUE(channel) << channel.error();
  const auto descriptor = (*channel)->report_descriptor();
  EXPECT_TRUE(std::equal(descriptor.begin(), descriptor.end(), device.report_descriptor().begin(),
                         device.report_descriptor().end()));
  EXPECT_GE((*channel)->descriptor(), 0);

  std::array<std::byte, 64> report{};
  EXPECT_EQ((*channel)->read(report, 0).state, ChannelState::kNothing) << "a deadline that is past does not wait";
  const std::int64_t before_ns = realtime::monotonic_now_ns();
  EXPECT_EQ((*channel)->read(report, before_ns + 20'000'000).state, ChannelState::kNothing);
  EXPECT_GE(realtime::monotonic_now_ns(), before_ns + 20'000'000);

  node.with_device([&] { device.deflect({350, 0, 0, 0, 0, 0}); });
  const Transferred came = (*channel)->read(report, in_ns(kSecond_ns));
  ASSERT_EQ(came.state, ChannelState::kDone);
  EXPECT_EQ(came.bytes, 7U);
  EXPECT_EQ(report[0], std::byte{1});
  EXPECT_EQ(report[1], std::byte{0x5E});

  node.stall_output(true);
  EXPECT_EQ((*channel)->write(codecs::space_mouse_light(true)).state, ChannelState::kStalled);
  node.stall_output(false);
  EXPECT_EQ((*channel)->write(codecs::space_mouse_light(true)).state, ChannelState::kDone);
  EXPECT_TRUE(node.with_device([&] { return device.is_lit(); }));
}

TEST_F(HidapiChannelTest, AFeatureThatIsNotThereIsAStall) {
  EmulatedHidraw node(*mock, device, 0);
  auto channel = HidapiChannel::open(node.path());
  ASSERT_TRUE(channel) << channel.error();
  std::array<std::byte, 8> feature{std::byte{5}};
  EXPECT_EQ((*channel)->get_feature(feature).state, ChannelState::kStalled);
  EXPECT_EQ((*channel)->set_feature(feature).state, ChannelState::kStalled);
}

TEST_F(HidapiChannelTest, UnplugWakesWhoWaits) {
  EmulatedHidraw node(*mock, device, 0);
  auto channel = HidapiChannel::open(node.path());
  ASSERT_TRUE(channel) << channel.error();
  std::thread hand([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    node.unplug();
  });
  std::array<std::byte, 64> report{};
  const std::int64_t before_ns = realtime::monotonic_now_ns();
  EXPECT_EQ((*channel)->read(report, before_ns + 20 * kSecond_ns).state, ChannelState::kGone);
  EXPECT_LT(realtime::monotonic_now_ns(), before_ns + 20 * kSecond_ns);
  hand.join();
  EXPECT_EQ((*channel)->write(codecs::space_mouse_light(true)).state, ChannelState::kGone);
  EXPECT_FALSE(HidapiChannel::open(node.path()));
}

TEST_F(HidapiChannelTest, NoPermissionIsToldWithTheRule) {
  EmulatedHidraw node(*mock, device, 0);
  ASSERT_EQ(::chmod(node.file().c_str(), 0), 0);
  std::vector<FoundHid> found;
  std::string error;
  std::thread([&] {
    respect_permissions();
    found = find_hid_devices();
    const auto channel = HidapiChannel::open(node.path());
    error = channel ? "" : channel.error();
  }).join();
  ASSERT_EQ(found.size(), 1U) << "it is there";
  EXPECT_NE(found[0].trouble.find("70-farfeel.rules"), std::string::npos) << found[0].trouble;
  EXPECT_NE(error.find("no permission"), std::string::npos) << error;
}

TEST_F(HidapiChannelTest, ADeviceHasOneUser) {
  EmulatedHidraw node(*mock, device, 0);
  auto channel = HidapiChannel::open(node.path());
  ASSERT_TRUE(channel) << channel.error();
  const auto second = HidapiChannel::open(node.path());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().find("another program"), std::string::npos) << second.error();
  ASSERT_EQ(find_hid_devices().size(), 1U);
  EXPECT_NE(find_hid_devices()[0].trouble.find("another program"), std::string::npos);
  channel->reset();
  EXPECT_TRUE(HidapiChannel::open(node.path()));
}

TEST_F(HidapiChannelTest, TheSpaceMouseThroughItAll) {
  EmulatedHidraw node(*mock, device, 0);
  const auto found = kSpaceMouseFamily.find({});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].model, "spacemouse");
  EXPECT_EQ(found[0].trouble, "");
  auto driver = kSpaceMouseFamily.open(found[0], {});
  ASSERT_TRUE(driver) << driver.error().message;
  Sample sample;
  Command command;
  command.is_light_on = true;
  const auto step_until = [&](auto is_so) {
    for (const std::int64_t end_ns = in_ns(10 * kSecond_ns); realtime::monotonic_now_ns() < end_ns && !is_so();) {
      (*driver)->step(in_ns(1'000'000), command, sample);
    }
    return is_so();
  };
  node.with_device([&] {
    device.deflect({350, 175, 0, 0, 0, -350});
    device.press(1);
  });
  EXPECT_TRUE(step_until([&] {
    return sample.deflection.push == glm::dvec3(1, -0.5, 0) && sample.deflection.turn == glm::dvec3(0, 0, 1) &&
           sample.has_button(0);
  }));
  EXPECT_TRUE(node.with_device([&] { return device.is_lit(); }));
  node.with_device([&] { device.deflect({}); });
  EXPECT_TRUE(
      step_until([&] { return sample.deflection.push == glm::dvec3(0) && sample.deflection.turn == glm::dvec3(0); }));
  EXPECT_EQ(sample.stage, Stage::kReady);
  node.unplug();
  EXPECT_TRUE(step_until([&] { return sample.stage == Stage::kAbsent; }));
  EXPECT_TRUE(kSpaceMouseFamily.find({}).empty());
}

}  // namespace

int main(int argc, char** argv) {
  enter_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
