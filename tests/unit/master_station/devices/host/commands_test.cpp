// The commands as a person runs them, through pipes in place of a terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "master_station/devices/host/found_list.h"
#include "tests/support/devices/socket_device.h"
#include "tests/support/private_folder.h"

namespace farfeel::devices {
namespace {

using test_support::SocketDevice;

struct Ran {
  int status = -1;
  std::string said;
};

/// Runs a shell's line to its end.
Ran run(const std::string& line) {
  Ran ran;
  std::FILE* const pipe = popen((line + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return ran;
  std::array<char, 4096> part;
  while (const std::size_t got = std::fread(part.data(), 1, part.size(), pipe)) ran.said.append(part.data(), got);
  const int status = pclose(pipe);
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return ran;
}

std::string socket_path() {
  static const test_support::PrivateFolder folder;
  return folder / "socket";
}

TEST(DeviceList, OfTheRealProgramTellsOfThisMachineWhateverIsPluggedIn) {
  const Ran as_json = run(FARFEEL_DEVICE " list --json");
  ASSERT_EQ(as_json.status, 0) << as_json.said;
  const auto json = nlohmann::json::parse(as_json.said);
  const Ran lines = run(FARFEEL_DEVICE " list --machine");
  EXPECT_EQ(lines.status, 0);
  EXPECT_EQ(std::ranges::count(lines.said, '\n'), json["devices"].size());
  EXPECT_EQ(std::ranges::count(lines.said, '\t'), 5 * json["devices"].size());
  const Ran by_front = run(FARFEEL_FRONT " device list");
  EXPECT_EQ(by_front.status, 0);
  EXPECT_NE(by_front.said.find(json["devices"].empty() ? "Looked for:" : kProof), std::string::npos) << by_front.said;
}

TEST(DeviceList, FindsADeviceAndSaysWhatItCan) {
  const SocketDevice device(socket_path());
  const Ran ran = run(FARFEEL_SOCKET_DEVICE_OWNER " list --firmware " + device.path());
  EXPECT_EQ(ran.status, 0);
  for (const char* part : {"A device at a socket, serial number 1", "position of 1; force of 1", kProof})
    EXPECT_NE(ran.said.find(part), std::string::npos) << ran.said;
  EXPECT_EQ(run(FARFEEL_SOCKET_DEVICE_OWNER " list --machine --firmware " + device.path()).said,
            "socket-device\t1\t" + device.path() + "\t1\tpose\t\n");
}

/// A command that runs beside the test, and what it says.
class Running {
 public:
  explicit Running(const std::string& line)
      : pipe_(popen(("echo $$; exec " + line + " 2>&1 <" + input()).c_str(), "r")) {
    std::setvbuf(pipe_, nullptr, _IONBF, 0);  // so that poll sees all that was not read
    pid_ = static_cast<pid_t>(std::strtol(line_with("").c_str(), nullptr, 10));
  }
  ~Running() {
    if (keyboard_ >= 0) ::close(keyboard_);
    if (pipe_ != nullptr) end();
    ::unlink(input().c_str());
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  /// As a person does.
  void type(const std::string& text) { std::ofstream(input(), std::ios::app) << text << std::flush; }
  /// The next line that holds `part`; empty: it ended before, or said nothing for half a minute.
  std::string line_with(const std::string& part) {
    std::array<char, 4096> line;
    pollfd from{fileno(pipe_), POLLIN, 0};
    while (::poll(&from, 1, 30'000) > 0 && std::fgets(line.data(), line.size(), pipe_) != nullptr)
      if (std::string text = line.data(); text.find(part) != std::string::npos) return text;
    return {};
  }
  /// Asks it to end, as Ctrl-C does; its exit status.
  int end() {
    if (pid_ > 0) ::kill(pid_, SIGINT);
    const int status = pclose(pipe_);
    pipe_ = nullptr;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  /// A pipe with a name, which this end keeps open.
  static std::string input() {
    const std::string path = socket_path() + ".keys";
    ::mkfifo(path.c_str(), 0600);
    return path;
  }
  int keyboard_ = ::open(input().c_str(), O_RDWR | O_CLOEXEC);
  std::FILE* pipe_;
  pid_t pid_ = -1;
};

TEST(DeviceWatch, TellsWhereTheHandleIsAndEndsInOrderWithoutForce) {
  SocketDevice device(socket_path());
  Running watch(FARFEEL_SOCKET_DEVICE_OWNER " watch socket-device --firmware " + device.path());
  ASSERT_TRUE(device.accept(30'000));
  std::atomic<bool> has_pushed{false};
  std::jthread hand([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      device.tell(0.025, 0b10);
      if (const auto taken = device.take(10); taken && taken->force_N != 0) has_pushed = true;
    }
  });
  // Before the first report has come, the handle is told to be in the middle.
  const std::string line = watch.line_with("socket-device:1 ready position_mm=25.00,0.00,0.00");
  EXPECT_NE(line.find("buttons=1 "), std::string::npos) << line;
  EXPECT_EQ(watch.end(), 0);
  EXPECT_FALSE(has_pushed);
}

TEST(DeviceWatch, SaysWhatIsMissing) {
  Running watch(FARFEEL_DEVICE " watch falcon:nobody-has-this");
  EXPECT_NE(watch.line_with("no falcon with serial number nobody-has-this is plugged in"), "");
  EXPECT_EQ(watch.end(), 0);
}

TEST(DeviceCommands, ANameThatIsNobodysIsNotWaitedFor) {
  for (const std::string command : {"watch", "test --yes", "calibrate", "identify-limits --yes"}) {
    const Ran near = run(FARFEEL_DEVICE " " + command + " falcno");
    EXPECT_EQ(near.status, 2) << command << near.said;
    EXPECT_NE(near.said.find("did you mean falcon? there are auto, "), std::string::npos) << near.said;
  }
  for (const auto& [typed, told] :
       {std::pair{"nonsense", "no device is known by that name; there are auto"},
        std::pair{"falcon:", "a serial number is missing"}, std::pair{"simulated", "no hardware"}}) {
    const Ran wrong = run(std::string(FARFEEL_DEVICE " watch ") + typed);
    EXPECT_EQ(wrong.status, 2) << wrong.said;
    EXPECT_NE(wrong.said.find(told), std::string::npos) << wrong.said;
  }
}

/// Hardware that a test moves: it tells where it is, and remembers the forces that it took. A hand that grips and feels
/// nothing for a second lets go and grips again, as people do: a late report disarms the force, and this machine may be
/// busy enough for one.
class Hand {
 public:
  explicit Hand(SocketDevice& device)
      : thread_([this, &device](const std::stop_token& stop) {
          auto gripped = Clock::now();
          while (!stop.stop_requested()) {
            const auto now = Clock::now();
            if (!grips || now - gripped > std::chrono::milliseconds(1050)) gripped = now;
            device.tell(x_m, grips && now - gripped < std::chrono::seconds(1) ? 1 : 0);
            if (const auto taken = device.take(5)) {
              if (taken->force_N != 0) gripped = Clock::now();
              most_N = std::max(most_N.load(), taken->force_N);
              least_N = std::min(least_N.load(), taken->force_N);
              ++taken_;
            }
          }
        }) {}
  /// Returns once the program has answered many times since: it has read where the hand is now.
  void move_to(double to_m) {
    constexpr int kMany = 50;
    x_m = to_m;
    const auto until = Clock::now() + std::chrono::seconds(30);
    for (const int before = taken_; taken_ < before + kMany && Clock::now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::atomic<double> x_m{0}, most_N{0}, least_N{0};
  std::atomic<bool> grips{false};

 private:
  std::atomic<int> taken_{0};
  using Clock = std::chrono::steady_clock;
  std::jthread thread_;
};

class DeviceWithPerson : public testing::Test {
 protected:
  DeviceWithPerson() { ::setenv("XDG_CONFIG_HOME", folder_.c_str(), 1); }
  ~DeviceWithPerson() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string command(const std::string& name) const {
    return FARFEEL_SOCKET_DEVICE_OWNER " " + name + " --firmware " + device_.path();
  }
  std::string folder_ = socket_path() + ".config";
  SocketDevice device_{socket_path()};
};

TEST_F(DeviceWithPerson, TestsAxesForceAndButtonAndSaysThatAllIsGood) {
  Running test(command("test"));
  ASSERT_TRUE(device_.accept(30'000));
  Hand hand(device_);
  ASSERT_NE(test.line_with("handle right"), "");
  hand.move_to(0.04);
  test.type("\n");
  ASSERT_NE(test.line_with("yes to consent"), "");
  EXPECT_EQ(hand.most_N, 0) << "no force before";
  hand.grips = true;
  test.type("yes\n");
  ASSERT_NE(test.line_with("Where did it push"), "");
  EXPECT_EQ(hand.least_N, 0);
  EXPECT_NEAR(hand.most_N, 1, 0.01) << "a fifth of 5 N";
  test.type("r\n");
  ASSERT_NE(test.line_with("Where did it push"), "");
  EXPECT_NEAR(hand.least_N, -1, 0.01);
  test.type("l\n");
  EXPECT_NE(test.line_with("checks are"), "");
}

TEST_F(DeviceWithPerson, CalibratesAndWritesTheDevicesOwnFile) {
  Running calibrate(command("calibrate"));
  ASSERT_TRUE(device_.accept(30'000));
  Hand hand(device_);
  ASSERT_NE(calibrate.line_with("handle right"), "");
  hand.move_to(0.03);
  calibrate.type("\n");
  ASSERT_NE(calibrate.line_with("in the middle"), "");
  calibrate.type("\n");
  ASSERT_NE(calibrate.line_with("Type yes"), "");
  calibrate.type("yes\n");
  ASSERT_NE(calibrate.line_with("Written to " + folder_ + "/farfeel/devices/socket-device-1.toml"), "");
  std::ifstream file(folder_ + "/farfeel/devices/socket-device-1.toml");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_NE(text.find("-0.03"), std::string::npos) << text;
}

TEST_F(DeviceWithPerson, KicksOnlyAfterConsentOnlyWhileHeldAndSoftly) {
  Running identify(command("identify-limits"));
  ASSERT_TRUE(device_.accept(30'000));
  Hand hand(device_);
  ASSERT_NE(identify.line_with("yes to consent"), "");
  identify.type("yes\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(hand.most_N, 0) << "nobody holds it";
  hand.grips = true;
  ASSERT_NE(identify.line_with("trying 100 N/m"), "");
  for (int i = 0; i < 3000 && hand.most_N == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_GT(hand.most_N, 0);
  EXPECT_LE(hand.most_N, 2);
  EXPECT_EQ(identify.end(), 1) << "broken off: nothing is written";
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

TEST(DeviceCommands, ThatAreUnknownOrContradictAreRefused) {
  EXPECT_NE(run(FARFEEL_DEVICE).status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " lists").status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " list --json --machine").status, 0);
}

}  // namespace
}  // namespace farfeel::devices
