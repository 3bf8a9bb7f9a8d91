// The commands as a person runs them, through pipes in place of a terminal.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

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

TEST(DeviceCommands, ThatAreUnknownOrContradictAreRefused) {
  EXPECT_NE(run(FARFEEL_DEVICE).status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " lists").status, 0);
  EXPECT_NE(run(FARFEEL_DEVICE " list --json --machine").status, 0);
}

}  // namespace
}  // namespace farfeel::devices
