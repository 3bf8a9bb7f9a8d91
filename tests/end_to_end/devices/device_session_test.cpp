// A whole session with a device: slave, master, farfeel-device and its keeper as processes, and the service of an
// Inverse3, imitated, whose arm is the judge of what the hand feels.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "deploy/front/child.h"
#include "master_station/report/report_page.h"
#include "tests/support/devices/inverse_service.h"
#include "tests/support/private_folder.h"

namespace farfeel {
namespace {

using front::Child;

// Far more than anything here takes, the baking of a scene on a machine's first run included; not a measurement.
constexpr auto kPatience = std::chrono::seconds(240);
constexpr const char* kScene = "block-gear";  // the quickest to bake
constexpr double kTouch_N = 0.3, kFree_N = 1e-9;
constexpr std::array<double, 3> kMiddle_m{0, -0.15, 0.1};  // of the arm's workspace

class DeviceSessionTest : public testing::Test {
 protected:
  void SetUp() override {
    // Nothing of the person who runs the test: neither calibrations nor which devices are known.
    setenv("XDG_CONFIG_HOME", (folder_ + "/config").c_str(), 1);
    setenv("XDG_STATE_HOME", (folder_ + "/state").c_str(), 1);
    setenv("FARFEEL_INVERSE3", service_.uri().c_str(), 1);
    service_.hold_at(kMiddle_m);
  }

  [[nodiscard]] Child start(const std::string& name, std::vector<std::string> arguments, bool has_ready) {
    auto child = Child::start(std::string(FARFEEL_PROGRAMS) + "/" + name, std::move(arguments),
                              fmt::format("{}/{}.log", folder_, name), Child::Output::kToLog, has_ready);
    if (!child) throw std::runtime_error(child.error().message);
    return std::move(*child);
  }

  [[nodiscard]] Child start_master(const Child& slave, std::vector<std::string> device = {"--device", "inverse3"}) {
    const auto port = slave.ready_port(std::chrono::duration<double>(kPatience).count(), -1);
    if (!port) throw std::runtime_error(port.error().message);
    std::vector<std::string> arguments{
        "--connect", fmt::format("127.0.0.1:{}", *port), "--out", folder_ + "/out", "--progress", "none"};
    arguments.insert(arguments.end(), device.begin(), device.end());
    return start("farfeel-master", std::move(arguments), false);
  }

  [[nodiscard]] static bool wait_until(const std::function<bool()>& wish) {
    for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
      if (wish()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  [[nodiscard]] std::string words() const {
    std::ifstream file(folder_ + "/farfeel-master.log");
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }
  /// Sooner or later, and after these words where some are given.
  [[nodiscard]] bool says(const std::string& what, const std::string& after = {}) const {
    return wait_until([&] {
      const std::string all = words();
      const std::size_t from = all.find(after);
      return from != std::string::npos && all.find(what, from) != std::string::npos;
    });
  }
  [[nodiscard]] double felt_N() const {
    const auto f = service_.force_N();
    return std::hypot(f[0], f[1], f[2]);
  }
  /// A surface pushes a hand that rests; after a stall a tool that follows does so too, but not for long.
  [[nodiscard]] bool is_pushed_at_rest() const {
    for (int i = 0; i < 10; ++i) {
      if (felt_N() < kTouch_N) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  /// As the station told it last: force is on, or comes once the axes of a new device are known.
  [[nodiscard]] bool is_force_on() const {
    const std::string all = words();
    const auto last = [&](const char* what) {
      const std::size_t at = all.rfind(what);
      return at == std::string::npos ? 0 : at;
    };
    return std::max(last("force is on"), last("its axes are tried")) > last("force is off");
  }
  /// Grips until force is on, and anew where the station says that it is off: a busy machine may leave the service
  /// silent for 20 ms, and then force waits for a grip, whatever is held.
  [[nodiscard]] bool takes_hold() {
    return wait_until([&] {
      if (!is_force_on()) {
        grip(false);
        grip(true);
      }
      const std::string all = words();
      const std::size_t on = all.rfind("force is on"), tried = all.rfind("its axes are tried");
      return is_force_on() && on != std::string::npos && (tried == std::string::npos || on > tried);
    });
  }
  /// The hand goes down until it feels something, and grips anew likewise.
  [[nodiscard]] bool touches() {
    constexpr double kReach_m = 0.08, kDown_m = 1e-4, kUp_m = 1e-3;  // for 5 ms each: no faster than a device can
    bool goes_down = true;
    for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
      if (goes_down && !is_force_on()) {
        grip(false);
        grip(true);
        continue;
      }
      const double above_m = hand_at_m_[2] - (kMiddle_m[2] - kReach_m);
      if (above_m <= 0 || above_m >= kReach_m) goes_down = above_m > 0;
      hand_at_m_[2] += goes_down ? -kDown_m : kUp_m;
      service_.hold_at(hand_at_m_);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (goes_down && is_pushed_at_rest()) return true;
    }
    return false;
  }
  [[nodiscard]] bool lets_go() const {
    return wait_until([&] { return felt_N() < kFree_N; });
  }
  [[nodiscard]] bool stays_free() const {
    for (int i = 0; i < 100; ++i) {
      if (felt_N() > kFree_N) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  void grip(bool is_held) {
    service_.press(is_held ? 1 : 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }

  devices::InverseService service_;
  std::array<double, 3> hand_at_m_ = kMiddle_m;
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
};

pid_t child_of(pid_t parent, const std::string& named) {
  std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", parent));
  for (pid_t child = -1; children >> child;) {
    std::ifstream file(fmt::format("/proc/{}/cmdline", child));
    std::string line;
    std::getline(file, line, '\0');
    if (line.find(named) != std::string::npos) return child;
  }
  return -1;
}

TEST_F(DeviceSessionTest, ASurfaceIsFeltAtTheArmAndNoDeathLeavesForceOnIt) {
  const Child slave = start("farfeel-slave", {"--scene", kScene, "--listen", "127.0.0.1:0"}, true);
  Child master = start_master(slave);
  ASSERT_TRUE(says("hold button 1 for force")) << words();
  EXPECT_TRUE(says("this device is new here"));
  EXPECT_TRUE(stays_free()) << "force before a grip";

  ASSERT_TRUE(takes_hold()) << words();
  EXPECT_TRUE(touches()) << words();
  grip(false);
  EXPECT_TRUE(lets_go()) << "force without a grip";

  grip(true);
  ASSERT_TRUE(touches()) << words();
  const pid_t owner = child_of(master.pid(), "farfeel-device");
  ASSERT_GT(owner, 0);
  ASSERT_EQ(kill(owner, SIGKILL), 0);
  EXPECT_TRUE(lets_go());
  EXPECT_TRUE(says("killed by signal 9"));
  ASSERT_TRUE(says("hold button 1 for force", "killed by signal 9")) << words();
  EXPECT_TRUE(stays_free()) << "force came back without a new grip";
  grip(false);
  grip(true);
  ASSERT_TRUE(touches()) << words();

  master.signal(SIGTERM);
  EXPECT_TRUE(lets_go());
  EXPECT_TRUE(wait_until([&] { return master.status().has_value(); }));
  EXPECT_EQ(master.status(), 0) << master.obituary();
  const auto summary = master_station::read_summary(folder_ + "/out");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_GT(summary->contact_share, 0);
  EXPECT_GT(summary->force_N.max, kTouch_N);
}

TEST_F(DeviceSessionTest, WhoHoldsTheButtonAllTheWhileIsToldToLetGoFirst) {
  const Child slave = start("farfeel-slave", {"--scene", kScene, "--listen", "127.0.0.1:0"}, true);
  Child master = start_master(slave);
  ASSERT_TRUE(says("ready, force is off: hold button 1 for force")) << words();
  ASSERT_TRUE(takes_hold()) << words();
  service_.set(devices::InverseService::Fault::kSilence);
  ASSERT_TRUE(says("the device does not answer")) << words();
  service_.set(devices::InverseService::Fault::kNone);
  EXPECT_TRUE(says("ready, force is off: let go, then hold button 1 for force")) << words();
}

TEST_F(DeviceSessionTest, ADeviceOfAPlugInIsReachedByItsOwnName) {
  const Child slave = start("farfeel-slave", {"--scene", kScene, "--listen", "127.0.0.1:0"}, true);
  const Child master = start_master(
      slave, {"--device", "simulated-handle:1", "--plug-in", std::string(FARFEEL_PLUG_INS) + "/simulated_handle.so"});
  EXPECT_TRUE(says("The hand is at the simulated-handle 1.")) << words();
  EXPECT_TRUE(says("Simulated handle on springs: ready")) << words();
}

TEST_F(DeviceSessionTest, ASimulatedDeviceWithoutAButtonIsFelt) {
  const Child slave = start("farfeel-slave", {"--scene", kScene, "--listen", "127.0.0.1:0"}, true);
  Child master = start_master(slave, {"--device", "simulated:wooden-haptics", "--seconds", "5"});
  ASSERT_TRUE(wait_until([&] { return master.status().has_value(); })) << words();
  const auto summary = master_station::read_summary(folder_ + "/out");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_GT(summary->contact_share, 0);
  EXPECT_GT(summary->force_N.max, kTouch_N);
}

TEST_F(DeviceSessionTest, TheDeathOfTheMasterLeavesNoForce) {
  const Child slave = start("farfeel-slave", {"--scene", kScene, "--listen", "127.0.0.1:0"}, true);
  Child master = start_master(slave);
  ASSERT_TRUE(says("hold button 1 for force")) << words();
  grip(true);
  ASSERT_TRUE(touches()) << words();
  master.signal(SIGKILL);
  EXPECT_TRUE(lets_go());
  EXPECT_TRUE(stays_free());
}

}  // namespace
}  // namespace farfeel
