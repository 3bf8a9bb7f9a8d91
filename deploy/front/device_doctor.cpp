#include "deploy/front/device_doctor.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

namespace farfeel::front {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRulesName = "70-farfeel.rules";
constexpr const char* kInstallRules =
    "as root: cp deploy/udev/70-farfeel.rules /etc/udev/rules.d/ && udevadm control --reload && udevadm trigger; then "
    "plug the device in again";
constexpr std::array kRulesFolders{"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d",
                                   "/lib/udev/rules.d"};

enum class Way : std::uint8_t { kUsb, kHid };

struct KnownIds {
  unsigned vendor, first, last;  ///< products
  const char* name;
  Way way;
};

constexpr std::array kKnown{KnownIds{0x0403, 0xcb48, 0xcb48, "Novint Falcon", Way::kUsb},
                            KnownIds{0x1234, 0x0006, 0x0006, "WoodenHaptics (mbed)", Way::kHid},
                            KnownIds{0x16c0, 0x0486, 0x0486, "WoodenHaptics (Teensy)", Way::kHid},
                            KnownIds{0x046d, 0xc603, 0xc640, "SpaceMouse", Way::kHid},
                            KnownIds{0x256f, 0xc62e, 0xc64f, "SpaceMouse", Way::kHid},
                            KnownIds{0x256f, 0xc652, 0xc652, "SpaceMouse receiver", Way::kHid}};

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

unsigned number_of(const fs::path& file, int base) {
  return static_cast<unsigned>(std::strtoul(text_of(file).c_str(), nullptr, base));
}

std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> all;
  std::error_code error;
  for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) all.push_back(i->path());
  std::ranges::sort(all);
  return all;
}

const KnownIds* known(unsigned vendor, unsigned product) {
  for (const KnownIds& ids : kKnown)
    if (ids.vendor == vendor && product >= ids.first && product <= ids.last) return &ids;
  return nullptr;
}

Finding rules(const MachineRoot& root, bool is_needed) {
  for (const char* folder : kRulesFolders)
    if (const std::string path = std::string(folder) + "/" + kRulesName; fs::exists(root.folder + path))
      return {"device rules", Health::kGood, path, ""};
  // The same under another name works only before 73-seat-late.rules, which grants what they ask for.
  for (const char* folder : kRulesFolders)
    for (const fs::path& file : entries(root.folder + folder))
      if (file.filename().string().find("farfeel") != std::string::npos && file.filename().string() >= "73")
        return {"device rules", Health::kLimited,
                fmt::format("{} comes after 73-seat-late.rules, and grants nothing", file.filename().string()),
                fmt::format("name it {}", kRulesName)};
  if (!is_needed) return {"device rules", Health::kGood, "none, and no device that needs them is plugged in", ""};
  return {"device rules", Health::kLimited, fmt::format("{} is not installed", kRulesName), kInstallRules};
}

/// Who has the node open, by /proc/*/fd: "1234 (name)". What this person may not look into is not seen.
std::string holders(const MachineRoot& root, const std::string& node) {
  std::string all;
  for (const fs::path& process : entries(root.folder + "/proc")) {
    const std::string id = process.filename().string();
    if (id.find_first_not_of("0123456789") != std::string::npos) continue;
    for (const fs::path& file : entries(process / "fd")) {
      std::error_code error;
      if (fs::read_symlink(file, error).string() != node) continue;
      all += fmt::format("{}{} ({})", all.empty() ? "" : ", ", id, text_of(process / "comm"));
      break;
    }
  }
  return all;
}

void examine_node(const MachineRoot& root, const std::string& name, const std::string& node,
                  std::vector<Finding>& findings) {
  if (!fs::exists(root.folder + node)) {
    findings.push_back({name, Health::kLimited, fmt::format("there is no {}", node), "plug it in again"});
    return;
  }
  if (!root.may_open(node)) {
    findings.push_back({name, Health::kLimited, fmt::format("no permission for {}", node), kInstallRules});
  } else {
    findings.push_back({name, Health::kGood, fmt::format("{} may be opened", node), ""});
  }
  if (const std::string who = holders(root, node); !who.empty()) {
    findings.push_back({name, Health::kLimited, fmt::format("{} is open in process {}", node, who),
                        "end that program: two cannot use one device"});
  }
}

void examine_usb(const MachineRoot& root, const fs::path& device, std::vector<Finding>& findings) {
  const KnownIds* const ids = known(number_of(device / "idVendor", 16), number_of(device / "idProduct", 16));
  if (ids == nullptr) return;
  const std::string name = ids->name;
  if (text_of(device / "power/control") == "auto") {
    findings.push_back(
        {name, Health::kLimited, "USB autosuspend is on: it may fall asleep between two forces",
         fmt::format("install the rules, or as root: echo on > {}",
                     (fs::path("/sys/bus/usb/devices") / device.filename() / "power/control").string())});
  }
  bool has_hid_node = false;
  for (const fs::path& interface : entries(root.folder + "/sys/bus/usb/devices")) {
    if (!interface.filename().string().starts_with(device.filename().string() + ":")) continue;
    std::error_code error;
    const std::string driver = fs::read_symlink(interface / "driver", error).filename().string();
    const std::string id = interface.filename().string();
    if (ids->way == Way::kUsb && !driver.empty() && driver != "usbfs") {
      findings.push_back({name, Health::kLimited, fmt::format("the kernel's {} holds it", driver),
                          fmt::format("farfeel-device takes it over by itself where it may; else as root: echo {} > "
                                      "/sys/bus/usb/drivers/{}/unbind",
                                      id, driver)});
    }
    if (ids->way == Way::kHid && driver != "usbhid" && text_of(interface / "bInterfaceClass") == "03") {
      findings.push_back({name, Health::kLimited,
                          driver.empty() ? std::string("no driver of the kernel is bound to it")
                                         : fmt::format("{} is bound to it, not usbhid", driver),
                          fmt::format("as root: echo {} > /sys/bus/usb/drivers/usbhid/bind", id)});
    }
    for (const fs::path& hid : entries(interface))
      for (const fs::path& raw : entries(hid / "hidraw")) {
        has_hid_node = true;
        if (ids->way == Way::kHid) examine_node(root, name, "/dev/" + raw.filename().string(), findings);
      }
  }
  if (ids->way == Way::kUsb) {
    examine_node(
        root, name,
        fmt::format("/dev/bus/usb/{:03}/{:03}", number_of(device / "busnum", 10), number_of(device / "devnum", 10)),
        findings);
  } else if (!has_hid_node) {
    findings.push_back(
        {name, Health::kLimited, "it has no hidraw node", "plug it in again; the kernel needs CONFIG_HIDRAW"});
  }
}

/// Joysticks with force feedback: /dev/input/event*, which only the group input may open, but for the rules.
void examine_joystick(const MachineRoot& root, const fs::path& event, std::vector<Finding>& findings) {
  const std::string effects = text_of(event / "device/capabilities/ff");
  if (effects.find_first_not_of("0 ") == std::string::npos) return;
  const std::string node = "/dev/input/" + event.filename().string(), name = text_of(event / "device/name");
  if (!root.may_open(node)) {
    findings.push_back({name, Health::kLimited, fmt::format("no permission for {}", node),
                        fmt::format("{}; or join the group input and log in again", kInstallRules)});
    return;
  }
  examine_node(root, name, node, findings);
}

}  // namespace

MachineRoot this_machine_root() {
  return {"", [](const std::string& path) { return ::access(path.c_str(), R_OK | W_OK) == 0; }};
}

std::vector<Finding> examine_devices(const MachineRoot& root) {
  std::vector<Finding> about;
  for (const fs::path& device : entries(root.folder + "/sys/bus/usb/devices"))
    if (device.filename().string().find(':') == std::string::npos) examine_usb(root, device, about);
  for (const fs::path& event : entries(root.folder + "/sys/class/input"))
    if (event.filename().string().starts_with("event")) examine_joystick(root, event, about);
  std::vector<Finding> findings{rules(root, !about.empty())};
  if (about.empty())
    findings.push_back({"haptic devices", Health::kGood, "none is plugged in; simulated ones need none", ""});
  findings.insert(findings.end(), about.begin(), about.end());
  return findings;
}

}  // namespace farfeel::front
