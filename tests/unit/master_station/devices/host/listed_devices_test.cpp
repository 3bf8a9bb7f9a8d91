// The program farfeel-device as people run it, on emulated devices: /dev and /sys of the child are this test's.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/space_mouse_emulator.h"
#include "tests/support/devices/under_umockdev.h"
#include "tests/support/devices/wooden_haptics_emulator.h"

using namespace farfeel::test_support;

namespace {

std::string output_of(const std::string& arguments, const std::string& before = {}) {
  std::FILE* const child = ::popen((before + FARFEEL_DEVICE + " " + arguments + " 2>&1").c_str(), "r");
  if (child == nullptr) return "popen failed";
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), child)) text.append(part.data(), n);
  ::pclose(child);
  return text;
}

struct ListedDevicesTest : testing::Test {
  void SetUp() override {
    if (const std::string why = why_not_under_umockdev(); !why.empty()) GTEST_SKIP() << why;
    mock = std::make_unique<MockDevices>();
  }
  std::unique_ptr<MockDevices> mock;
};

TEST_F(ListedDevicesTest, ListsWhatIsPluggedIn) {
  EXPECT_NE(output_of("list").find("No haptic device"), std::string::npos);
  SpaceMouseEmulator mouse(SpaceMouseReports::kCombined);
  WoodenHapticsEmulator arm;
  EmulatedHidraw first(*mock, mouse, 0), second(*mock, arm, 1);
  const std::string text = output_of("list --json");
  SCOPED_TRACE(text);
  EXPECT_NE(text.find("spacemouse"), std::string::npos);
  EXPECT_NE(text.find("36A8"), std::string::npos);
  EXPECT_NE(text.find("wooden-haptics"), std::string::npos);
  EXPECT_NE(text.find("WH0001"), std::string::npos);
}

TEST_F(ListedDevicesTest, WatchesTheSpaceMouse) {
  SpaceMouseEmulator mouse(SpaceMouseReports::kSplit);
  EmulatedHidraw node(*mock, mouse, 0);
  node.with_device([&] { mouse.deflect({350, 0, 0, 0, 0, -175}); });
  const std::string text = output_of("watch spacemouse", "timeout --signal=INT 2 ");
  SCOPED_TRACE(text);
  EXPECT_NE(text.find("spacemouse: ready"), std::string::npos);
  EXPECT_NE(text.find("push=1.00,0.00,0.00 turn=0.00,0.00,0.50"), std::string::npos);
}

}  // namespace

int main(int argc, char** argv) {
  enter_umockdev(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
