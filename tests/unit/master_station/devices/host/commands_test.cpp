// The commands as a person runs them, through pipes in place of a terminal.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "master_station/devices/host/found_list.h"
#include "tests/support/devices/socket_device.h"

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
  return (std::filesystem::temp_directory_path() / ("farfeel-commands-" + std::to_string(getpid()))).string();
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
  explicit Running(const std::string& line) : pipe_(popen(("echo $$; exec " + line + " 2>&1").c_str(), "r")) {
    pid_ = static_cast<pid_t>(std::strtol(line_with("").c_str(), nullptr, 10));
  }
  ~Running() {
    if (pipe_ != nullptr) pclose(pipe_);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  /// The next line that holds `part`; empty: it ended before.
  std::string line_with(const std::string& part) {
    std::array<char, 4096> line;
    while (std::fgets(line.data(), line.size(), pipe_) != nullptr)
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
  std::FILE* pipe_;
  pid_t pid_ = -1;
};

TEST(DeviceWatch, TellsWhereTheHandleIsAndEndsInOrderWithoutForce) {
  SocketDevice device(socket_path());
  Running watch(FARFEEL_SOCKET_DEVICE_OWNER " watch socket-device --firmware " + device.path());
  ASSERT_TRUE(device.accept(5000));
  std::atomic<bool> has_pushed{false};
  std::jthread hand([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      device.tell(0.025, 0b10);
      if (const auto taken = device.take(10); taken && taken->force_N != 0) has_pushed = true;
    }
  });
  const std::string line = watch.line_with("ready");
  EXPECT_NE(line.find("socket-device:1 ready position_mm=25.00,0.00,0.00"), std::string::npos) << line;
  EXPECT_NE(line.find("buttons=1 "), std::string::npos) << line;
  EXPECT_EQ(watch.end(), 0);
  EXPECT_FALSE(has_pushed);
}

TEST(DeviceWatch, SaysWhatIsMissing) {
  Running watch(FARFEEL_DEVICE " watch falcon:nobody-has-this");
  EXPECT_NE(watch.line_with("no falcon with serial number nobody-has-this is plugged in"), "");
  EXPECT_EQ(watch.end(), 0);
}

TEST(DeviceCommands, ThatAreUnknownOrContradictAreRefused) {
  EXPECT_NE(run(FARFEEL_DEVICE).status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " lists").status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " list --json --machine").status, 0);
}

}  // namespace
}  // namespace farfeel::devices
