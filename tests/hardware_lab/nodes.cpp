#include "tests/hardware_lab/nodes.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

namespace farfeel::hardware_lab {
namespace {

std::string first_word(const std::filesystem::path& file) {
  std::string word;
  std::ifstream(file) >> word;
  return word;
}

}  // namespace

std::string hidraw_node(std::uint16_t vendor, std::uint16_t product) {
  // /sys/class/hidraw/hidraw0/device -> .../0003:256F:C635.0001
  const std::string ids = fmt::format(":{:04X}:{:04X}.", vendor, product);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/hidraw", error)) {
    const auto device = std::filesystem::read_symlink(entry.path() / "device", error);
    if (device.filename().string().find(ids) != std::string::npos) return "/dev/" + entry.path().filename().string();
  }
  return {};
}

std::string usb_node(std::uint16_t vendor, std::uint16_t product) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/bus/usb/devices", error)) {
    if (first_word(entry.path() / "idVendor") != fmt::format("{:04x}", vendor) ||
        first_word(entry.path() / "idProduct") != fmt::format("{:04x}", product)) {
      continue;
    }
    return fmt::format("/dev/bus/usb/{:03}/{:03}", std::stoi(first_word(entry.path() / "busnum")),
                       std::stoi(first_word(entry.path() / "devnum")));
  }
  return {};
}

}  // namespace farfeel::hardware_lab
