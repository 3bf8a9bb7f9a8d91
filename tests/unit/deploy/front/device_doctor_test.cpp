// The doctor on machines made of files; and whether the rules know every device that a driver knows.
#include "deploy/front/device_doctor.h"

#include <fnmatch.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>

#include "codecs/device/space_mouse.h"
#include "tests/support/private_folder.h"

namespace farfeel::front {
namespace {

namespace fs = std::filesystem;

class DeviceDoctor : public testing::Test {
 protected:
  void file(const std::string& path, const std::string& text) const {
    fs::create_directories(fs::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text << "\n";
  }
  void link(const std::string& path, const std::string& to) const {
    fs::create_directories(fs::path(root_ + path).parent_path());
    fs::create_symlink(to, root_ + path);
  }
  void usb(const std::string& at, const std::string& vendor, const std::string& product) const {
    const std::string folder = "/sys/bus/usb/devices/" + at;
    file(folder + "/idVendor", vendor);
    file(folder + "/idProduct", product);
    file(folder + "/busnum", "1");
    file(folder + "/devnum", "7");
    file(folder + "/power/control", "on");
  }
  void falcon() const {
    usb("1-2", "0403", "cb48");
    file("/dev/bus/usb/001/007", "");
  }
  [[nodiscard]] std::string told(bool may_open = true) const {
    std::string all;
    for (const Finding& finding : examine_devices({root_, [&](const std::string&) { return may_open; }})) {
      EXPECT_NE(finding.health, Health::kMissing) << "a session runs without devices";
      EXPECT_EQ(finding.health == Health::kGood, finding.remedy.empty()) << finding.seen;
      all += (finding.health == Health::kGood ? "good " : "bad ") + finding.what + ": " + finding.seen + " -> " +
             finding.remedy + "\n";
    }
    return all;
  }
  test_support::PrivateFolder folder_;
  const std::string root_ = folder_.path();
};

#define EXPECT_TELLS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST_F(DeviceDoctor, OfAnEmptyMachineIsContent) {
  EXPECT_TELLS(told(), "good device rules: none, and no device");
  EXPECT_TELLS(told(), "good haptic devices: none is plugged in");
}

TEST_F(DeviceDoctor, NamesTheMissingRuleAndOneThatComesTooLate) {
  falcon();
  EXPECT_TELLS(told(false), "bad device rules: 70-farfeel.rules is not installed");
  EXPECT_TELLS(told(false), "bad Novint Falcon: no permission for /dev/bus/usb/001/007");
  file("/etc/udev/rules.d/99-farfeel.rules", "");
  EXPECT_TELLS(told(false), "99-farfeel.rules comes after 73-seat-late.rules");
  file("/etc/udev/rules.d/70-farfeel.rules", "");
  EXPECT_TELLS(told(), "good device rules: /etc/udev/rules.d/70-farfeel.rules");
  EXPECT_TELLS(told(), "good Novint Falcon: /dev/bus/usb/001/007 may be opened");
}

TEST_F(DeviceDoctor, NamesTheWrongDriverTheBusyProcessAndAutosuspend) {
  falcon();
  file("/sys/bus/usb/devices/1-2:1.0/bInterfaceClass", "ff");
  link("/sys/bus/usb/devices/1-2:1.0/driver", "../../../bus/usb/drivers/ftdi_sio");
  file("/sys/bus/usb/devices/1-2/power/control", "auto");
  file("/proc/4711/comm", "other-program");
  link("/proc/4711/fd/5", "/dev/bus/usb/001/007");
  link("/proc/4712/fd/5", "/dev/bus/usb/001/008");
  const std::string text = told();
  EXPECT_TELLS(text, "the kernel's ftdi_sio holds it");
  EXPECT_TELLS(text, "/dev/bus/usb/001/007 is open in process 4711 (other-program)");
  EXPECT_TELLS(text, "USB autosuspend is on");
  EXPECT_EQ(text.find("4712"), std::string::npos) << text;
}

TEST_F(DeviceDoctor, FindsHidDevicesByTheirHidrawNode) {
  usb("1-3", "256f", "c635");
  file("/sys/bus/usb/devices/1-3:1.0/bInterfaceClass", "03");
  EXPECT_TELLS(told(), "no driver of the kernel is bound to it");
  link("/sys/bus/usb/devices/1-3:1.0/driver", "../../drivers/usbhid");
  EXPECT_TELLS(told(), "it has no hidraw node");
  file("/sys/bus/usb/devices/1-3:1.0/0003:256F:C635.0001/hidraw/hidraw3/dev", "");
  file("/dev/hidraw3", "");
  EXPECT_TELLS(told(), "good SpaceMouse: /dev/hidraw3 may be opened");
  EXPECT_TELLS(told(false), "no permission for /dev/hidraw3");
}

TEST_F(DeviceDoctor, NamesTheGroupOfJoysticksAndLeavesOthersAlone) {
  file("/sys/class/input/event4/device/capabilities/ff", "30f0000 0");
  file("/sys/class/input/event4/device/name", "A Joystick");
  file("/sys/class/input/event5/device/capabilities/ff", "0");
  file("/sys/class/input/event5/device/name", "A Keyboard");
  file("/dev/input/event4", "");
  usb("1-4", "1d6b", "0002");
  const std::string text = told(false);
  EXPECT_TELLS(text, "bad A Joystick: no permission for /dev/input/event4");
  EXPECT_TELLS(text, "group input");
  EXPECT_EQ(text.find("Keyboard"), std::string::npos);
}

std::string whole(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string hexadecimal(unsigned id, bool is_upper) {
  std::array<char, 8> text;
  std::snprintf(text.data(), text.size(), is_upper ? "%04X" : "%04x", id);
  return text.data();
}

/// Whether a rule gives such a device to the person at the machine: a HID device by the name of its node, any other by
/// its ids.
bool is_in(const std::string& rules, unsigned vendor, unsigned product) {
  const std::string hid = "0003:" + hexadecimal(vendor, true) + ":" + hexadecimal(product, true) + ".0001";
  static const std::regex by_name("\\nKERNELS==\"([^\"]*)\", TAG\\+=\"uaccess\"");
  for (std::sregex_iterator i(rules.begin(), rules.end(), by_name), end; i != end; ++i)
    if (fnmatch((*i)[1].str().c_str(), hid.c_str(), 0) == 0) return true;
  const std::string usb = "ATTR{idVendor}==\"" + hexadecimal(vendor, false) + "\", ATTR{idProduct}==\"" +
                          hexadecimal(product, false) + "\", TAG+=\"uaccess\"";
  return rules.find(usb) != std::string::npos;
}

TEST(DeviceRules, KnowEveryIdThatADriverKnowsAndSortBeforeWhatGrantsThem) {
  const std::string rules = whole(FARFEEL_RULES);
  ASSERT_FALSE(rules.empty());
  EXPECT_LT(fs::path(FARFEEL_RULES).filename().string(), "73");
  EXPECT_FALSE(is_in(rules, 0xdead, 0xbeef));
  std::set<std::pair<unsigned, unsigned>> ids;
  // Drivers write their ids as {0xVVVV, 0xPPPP}; the SpaceMouse's family is a question to its codec.
  static const std::regex pair("\\{0x([0-9a-f]{4}), 0x([0-9a-f]{4})[,}]");
  for (const auto& entry : fs::directory_iterator(FARFEEL_DRIVERS)) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string source = whole(entry.path());
    for (std::sregex_iterator i(source.begin(), source.end(), pair), end; i != end; ++i)
      ids.insert({static_cast<unsigned>(std::stoul((*i)[1].str(), nullptr, 16)),
                  static_cast<unsigned>(std::stoul((*i)[2].str(), nullptr, 16))});
  }
  EXPECT_GE(ids.size(), 3U) << "the Falcon and two boards of WoodenHaptics at least: has the pattern changed?";
  constexpr std::uint16_t kDesktop = 1, kMultiAxis = 8;
  for (const unsigned vendor : {0x046dU, 0x256fU})
    for (unsigned product = 0xc000; product < 0xd000; ++product)
      if (codecs::space_mouse_title(static_cast<std::uint16_t>(vendor), static_cast<std::uint16_t>(product), kDesktop,
                                    kMultiAxis))
        ids.insert({vendor, product});
  EXPECT_GE(ids.size(), 20U);
  for (const auto& [vendor, product] : ids)
    EXPECT_TRUE(is_in(rules, vendor, product)) << hexadecimal(vendor, false) << ":" << hexadecimal(product, false);
  EXPECT_NE(rules.find("ENV{ID_INPUT_JOYSTICK}"), std::string::npos);
  EXPECT_NE(rules.find("power/control"), std::string::npos) << "USB autosuspend";
}

}  // namespace
}  // namespace farfeel::front
