// libusb as it is, on an emulated usbfs node with the emulated Falcon behind it.

#include "master_station/devices/channel/libusb_channel.h"

#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <thread>
#include <vector>

#include "codecs/device/falcon.h"
#include "codecs/device/ftdi.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/usb_listing.h"
#include "master_station/devices/driver/falcon_driver.h"
#include "tests/support/devices/emulated_usbfs.h"
#include "tests/support/devices/under_umockdev.h"

using namespace farfeel;
using namespace farfeel::devices;
using namespace farfeel::test_support;

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::array kFalcon{UsbId{0x0403, 0xcb48}};
constexpr std::array<std::string_view, 1> kGivesWay{"ftdi_sio"};
constexpr UsbEndpoints kEndpoints{.interface = 0, .in = 0x81, .out = 0x02};

std::int64_t in_ns(std::int64_t ns) {
  return realtime::monotonic_now_ns() + ns;
}

std::vector<FoundUsb> found() {
  return find_usb_devices(kFalcon, kGivesWay);
}

struct LibusbChannelTest : testing::TestWithParam<EmulatedUsbfs::Node> {
  void SetUp() override {
    if (const std::string why = why_not_under_umockdev(); !why.empty()) GTEST_SKIP() << why;
    mock = std::make_unique<MockDevices>();
  }
  /// The running firmware's set-up, by hand.
  static void set_up(UsbChannel& channel) {
    for (const auto& one : {codecs::ftdi_latency_ms(1), codecs::ftdi_baud(0x2), codecs::kFtdiPurgeReceived})
      ASSERT_EQ(channel.control(codecs::kFtdiRequestType, one.request, one.value, 0).state, ChannelState::kDone);
  }
  /// Replies to n packets, sent one after another.
  static int exchanged(UsbChannel& channel, int n) {
    codecs::FalconStream stream;
    std::array<std::byte, 512> transfer, payload;
    int replies = 0;
    for (int i = 0; i < n; ++i) {
      if (channel.send(codecs::encoded(codecs::FalconCommand{})).state != ChannelState::kDone) break;
      const std::int64_t end_ns = in_ns(500 * kMs);
      for (bool is_answered = false; !is_answered && realtime::monotonic_now_ns() < end_ns;) {
        const Transferred came = channel.receive(transfer, end_ns);
        if (came.state != ChannelState::kDone) break;
        const std::size_t size = codecs::ftdi_payload(std::span(transfer).first(came.bytes), payload);
        is_answered = stream.take(std::span(payload).first(size)).has_value();
        replies += is_answered ? 1 : 0;
      }
    }
    return replies;
  }
  std::unique_ptr<MockDevices> mock;
  FalconEmulator device{{.has_firmware = true, .is_homed = true, .mechanics = {}}};
};

TEST_F(LibusbChannelTest, FindsByIdAndSaysWhatIsInTheWay) {
  EXPECT_TRUE(found().empty());
  EmulatedUsbfs node(*mock, device, 7);
  ASSERT_EQ(found().size(), 1U);
  const FoundUsb usb = found().front();
  EXPECT_EQ(usb.serial, FalconEmulator::kSerial);
  EXPECT_EQ(usb.port, "1-7");
  EXPECT_EQ(usb.path, node.path());
  EXPECT_EQ(usb.trouble, "");
  EXPECT_TRUE(find_usb_devices(std::array{UsbId{0x0403, 0x6001}}, kGivesWay).empty());

  node.bind_driver("ftdi_sio");
  EXPECT_EQ(found().front().driver, "ftdi_sio");
  EXPECT_EQ(found().front().trouble, "") << "it gives way";
  node.bind_driver("usbserial_generic");
  EXPECT_NE(found().front().trouble.find("usbserial_generic"), std::string::npos);

  // Another program: this test's own /proc entry is not told, as its own claim is no trouble.
  node.bind_driver("usbfs");
  EXPECT_EQ(found().front().trouble, "");

  ASSERT_EQ(::chmod(node.file().c_str(), 0), 0);
  std::thread([&] {
    respect_permissions();
    ASSERT_EQ(found().size(), 1U);
    EXPECT_NE(found().front().trouble.find("no permission"), std::string::npos) << found().front().trouble;
    EXPECT_NE(found().front().trouble.find("70-farfeel.rules"), std::string::npos);
    const auto channel = LibusbChannel::open(usb, kEndpoints);
    ASSERT_FALSE(channel);
    EXPECT_NE(channel.error().find("70-farfeel.rules"), std::string::npos) << channel.error();
  }).join();
  node.unplug();
  EXPECT_TRUE(found().empty());
}

TEST_F(LibusbChannelTest, IsToldWhenAnotherProgramHasIt) {
  EmulatedUsbfs node(*mock, device, 7);
  node.claim_elsewhere(true);
  const auto channel = LibusbChannel::open(found().front(), kEndpoints);
  ASSERT_FALSE(channel);
  EXPECT_NE(channel.error().find("busy"), std::string::npos) << channel.error();
  node.claim_elsewhere(false);
  EXPECT_TRUE(LibusbChannel::open(found().front(), kEndpoints));
  EXPECT_TRUE(LibusbChannel::open(found().front(), kEndpoints)) << "its end gives the claim back";
}

TEST_P(LibusbChannelTest, ExchangesPacketsAndWaitsNoLongerThanTold) {
  EmulatedUsbfs node(*mock, device, 7, GetParam());
  auto channel = LibusbChannel::open(found().front(), kEndpoints);
  ASSERT_TRUE(channel) << channel.error();
  EXPECT_EQ((*channel)->descriptor() >= 0, GetParam() == EmulatedUsbfs::Node::kFile);
  set_up(**channel);
  const std::int64_t begin_ns = realtime::monotonic_now_ns();
  EXPECT_EQ(exchanged(**channel, 100), 100);
  std::printf("an exchange takes %.2f ms here\n", 1e-6 * double(realtime::monotonic_now_ns() - begin_ns) / 100);
  EXPECT_EQ((*channel)->control(0xc0, 0x77, 0, 0).state, ChannelState::kStalled) << "no such request";
  EXPECT_EQ((*channel)->send(std::array<std::byte, LibusbChannel::kTransferBytes + 1>{}).state, ChannelState::kNothing);
}

TEST_P(LibusbChannelTest, AStallIsToldAndClearedAndTheNextExchangeGoesOn) {
  EmulatedUsbfs node(*mock, device, 7, GetParam());
  auto channel = LibusbChannel::open(found().front(), kEndpoints);
  ASSERT_TRUE(channel) << channel.error();
  set_up(**channel);
  node.with_device([&] { device.set_fault(FalconFault::kStalled); });
  std::array<std::byte, 512> transfer;
  ChannelState state = ChannelState::kDone;
  for (int i = 0; i < 100 && state != ChannelState::kStalled; ++i)
    state = (*channel)->receive(transfer, in_ns(20 * kMs)).state;
  EXPECT_EQ(state, ChannelState::kStalled);
  for (int i = 0; i < 100 && node.halts_cleared() == 0; ++i) (void)(*channel)->receive(transfer, in_ns(20 * kMs));
  EXPECT_GT(node.halts_cleared(), 0) << "once its other reads were cancelled";
  node.with_device([&] { device.set_fault(FalconFault::kNone); });
  for (int i = 0; i < 100 && state == ChannelState::kStalled; ++i)
    state = (*channel)->receive(transfer, in_ns(20 * kMs)).state;
  EXPECT_EQ(exchanged(**channel, 10), 10);
}

TEST_P(LibusbChannelTest, UnpluggedIsGoneForGoodAndPluggedInAgainIsAnother) {
  auto node = std::make_unique<EmulatedUsbfs>(*mock, device, 7, GetParam());
  auto channel = LibusbChannel::open(found().front(), kEndpoints);
  ASSERT_TRUE(channel) << channel.error();
  set_up(**channel);
  EXPECT_EQ(exchanged(**channel, 5), 5);
  node->unplug();
  std::array<std::byte, 512> transfer;
  ChannelState state = ChannelState::kDone;
  for (int i = 0; i < 100 && state != ChannelState::kGone; ++i)
    state = (*channel)->receive(transfer, in_ns(20 * kMs)).state;
  EXPECT_EQ(state, ChannelState::kGone);
  EXPECT_EQ((*channel)->send(std::array<std::byte, 16>{}).state, ChannelState::kGone);
  EXPECT_EQ((*channel)->control(0x40, 0, 1, 0).state, ChannelState::kGone);
  channel->reset();
  node.reset();
  EXPECT_TRUE(found().empty());
  node = std::make_unique<EmulatedUsbfs>(*mock, device, 8, GetParam());
  channel = LibusbChannel::open(found().front(), kEndpoints);
  ASSERT_TRUE(channel) << channel.error();
  set_up(**channel);
  EXPECT_EQ(exchanged(**channel, 5), 5);
}

INSTANTIATE_TEST_SUITE_P(Node, LibusbChannelTest,
                         testing::Values(EmulatedUsbfs::Node::kFile, EmulatedUsbfs::Node::kFifo),
                         [](const auto& one) { return one.param == EmulatedUsbfs::Node::kFile ? "file" : "fifo"; });

/// From power-on to a force, through the family, with firmware from a file; then unplugged and plugged in again.
TEST_F(LibusbChannelTest, TheFalconComesFromPowerOnToAForce) {
  const std::string firmware = mock->root() + "/firmware.bin";
  {
    std::vector<char> bytes(22 + 6 + 2 * 150 + 2, 0);
    bytes[0] = '\xaa', bytes[1] = '\x08', bytes[22] = '\x96';  // one block of 150 words
    std::ofstream(firmware, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  FalconEmulator cold({.watchdog_ns = 1'000'000 * kMs, .mechanics = {}});  // nobody else takes force off
  auto node = std::make_unique<EmulatedUsbfs>(*mock, cold, 7);
  node->bind_driver("ftdi_sio");
  const DriverOptions options{.firmware = firmware, .plug_in = {}};
  ASSERT_EQ(kFalconFamily.find(options).size(), 1U);
  EXPECT_EQ(kFalconFamily.find(options).front().model, "falcon");
  auto driver = kFalconFamily.open(kFalconFamily.find(options).front(), options);
  ASSERT_TRUE(driver) << driver.error().message;
  EXPECT_NE((*driver)->identity().path.find("ftdi_sio was taken off"), std::string::npos);

  Sample sample;
  Command command;
  const auto step_until = [&](Stage wanted, std::int64_t most_ns) {
    const std::int64_t end_ns = in_ns(most_ns);
    Stage stage = (*driver)->step(in_ns(kMs), command, sample);
    while (stage != wanted && realtime::monotonic_now_ns() < end_ns)
      stage = (*driver)->step(in_ns(kMs), command, sample);
    return stage;
  };
  constexpr std::int64_t kLong_ns = 20'000 * kMs;
  EXPECT_EQ(step_until(Stage::kFirmware, kLong_ns), Stage::kFirmware);
  EXPECT_EQ(step_until(Stage::kHoming, kLong_ns), Stage::kHoming);
  const auto move = [&](double z) {
    node->with_device([&] {
      cold.set_hand(
          {.target_F_m = {0, 0, z}, .stiffness_N_per_m = 2000, .damping_Ns_per_m = 40, .force_F_N = {0, 0, 0}});
    });
    step_until(Stage::kReady, 400 * kMs);
  };
  move(0.165);
  move(0.085);
  move(0.12);
  ASSERT_EQ(step_until(Stage::kReady, kLong_ns), Stage::kReady) << (*driver)->advice();
  const glm::dvec3 wanted_F(0, 1, 2);
  const auto pushed = [&] { return node->with_device([&] { return cold.mechanism().motor_force_F_N(); }); };
  // Under load an emulated exchange may take more than 20 ms: a fault, which ends. The hand comes to rest meanwhile.
  const auto is_pushed = [&] { return glm::distance(pushed(), wanted_F) < 0.1; };
  const auto push = [&] {
    command.is_force_on = true;
    command.F_hand_B.force_N = {0, -2, 1};
    for (const std::int64_t end_ns = in_ns(kLong_ns); !is_pushed() && realtime::monotonic_now_ns() < end_ns;)
      (void)(*driver)->step(in_ns(kMs), command, sample);
    EXPECT_TRUE(is_pushed()) << pushed().y << ' ' << pushed().z << ' ' << (*driver)->advice();
  };
  push();

  // As the keeper takes it off, with one system call. It has a duplicate; umockdev knows the descriptor itself alone.
  auto zero = (*driver)->zero_force();
  ASSERT_TRUE(zero);
  usbdevfs_bulktransfer transfer{
      .ep = zero->endpoint, .len = static_cast<unsigned>(zero->size), .timeout = 10, .data = zero->bytes.data()};
  EXPECT_EQ(::ioctl(zero->fd, USBDEVFS_BULK, &transfer), static_cast<int>(zero->size));
  EXPECT_EQ(glm::length(pushed()), 0);

  node->unplug();
  EXPECT_EQ(step_until(Stage::kAbsent, kLong_ns), Stage::kAbsent);
  driver->reset();
  node.reset();
  EXPECT_TRUE(kFalconFamily.find(options).empty());
  node = std::make_unique<EmulatedUsbfs>(*mock, cold, 9);
  driver = kFalconFamily.open(kFalconFamily.find(options).front(), options);
  ASSERT_TRUE(driver) << driver.error().message;
  command = {};
  EXPECT_EQ(step_until(Stage::kReady, kLong_ns), Stage::kReady) << (*driver)->advice();
  push();
  driver->reset();
  EXPECT_EQ(glm::length(pushed()), 0) << "its end takes force off";
}

TEST_F(LibusbChannelTest, FirmwareThatIsNoneIsToldBeforeAnythingIsOpened) {
  EmulatedUsbfs node(*mock, device, 7);
  const FoundDevice falcon = kFalconFamily.find({}).front();
  auto driver = kFalconFamily.open(falcon, {.firmware = "/nowhere/falcon.bin", .plug_in = {}});
  ASSERT_FALSE(driver);
  EXPECT_NE(driver.error().message.find("/nowhere/falcon.bin cannot be read"), std::string::npos);
  driver = kFalconFamily.open(falcon, {.firmware = "/proc/self/cmdline", .plug_in = {}});
  ASSERT_FALSE(driver);
  EXPECT_NE(driver.error().message.find("name the .bin file"), std::string::npos) << driver.error().message;
}

}  // namespace

int main(int argc, char** argv) {
  enter_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
