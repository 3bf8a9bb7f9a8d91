// Finding and opening a Falcon: USB, and the file of its firmware.
#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "master_station/devices/channel/libusb_channel.h"
#include "master_station/devices/channel/usb_listing.h"
#include "master_station/devices/driver/falcon_driver.h"

namespace farfeel::devices {

namespace {

constexpr std::array kIds{UsbId{0x0403, 0xcb48}};
constexpr std::array<std::string_view, 1> kGivesWay{"ftdi_sio"};  // the kernel's serial driver for the same chip
constexpr UsbEndpoints kEndpoints{.interface = 0, .in = 0x81, .out = 0x02};

FoundDevice told(const FoundUsb& usb) {
  return {.model = "falcon", .serial = usb.serial, .path = usb.path, .trouble = usb.trouble};
}

std::vector<FoundDevice> find(const DriverOptions&) {
  std::vector<FoundDevice> all;
  for (const FoundUsb& usb : find_usb_devices(kIds, kGivesWay)) all.push_back(told(usb));
  return all;
}

/// Empty where no file is named.
tl::expected<std::vector<std::byte>, DeviceError> firmware_in(const std::string& path) {
  std::vector<std::byte> bytes;
  if (path.empty()) return bytes;
  std::ifstream file(path, std::ios::binary);
  if (!file)
    return tl::unexpected(DeviceError{fmt::format("firmware {} cannot be read: {}", path, std::strerror(errno))});
  bytes.resize(codecs::kMostFalconFirmwareBytes + 1);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (const std::string_view trouble = codecs::falcon_firmware_trouble(bytes); !trouble.empty())
    return tl::unexpected(
        DeviceError{fmt::format("firmware {} {}: name the .bin file of Novint's driver", path, trouble)});
  return bytes;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open(const FoundDevice& found, const DriverOptions& options) {
  auto firmware = firmware_in(options.firmware);
  if (!firmware) return tl::unexpected(firmware.error());
  for (const FoundUsb& usb : find_usb_devices(kIds, kGivesWay)) {
    if (usb.path != found.path) continue;
    auto channel = LibusbChannel::open(usb, kEndpoints);
    if (!channel) return tl::unexpected(DeviceError{channel.error()});
    FoundDevice identity = told(usb);
    if (!usb.driver.empty() && usb.driver != "usbfs")
      identity.path += fmt::format(" (the kernel's driver {} was taken off it)", usb.driver);
    return std::make_unique<FalconDriver>(std::move(identity), *std::move(channel), *std::move(firmware));
  }
  return tl::unexpected(DeviceError{fmt::format("the Falcon at {} was unplugged", found.path)});
}

}  // namespace

const DriverFamily kFalconFamily{.name = "falcon", .find = find, .open = open};

}  // namespace farfeel::devices
