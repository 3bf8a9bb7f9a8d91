// USB devices that are plugged in, from sysfs: cheap enough to be asked for each second, and it opens none of them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace farfeel::devices {

struct UsbId {
  std::uint16_t vendor = 0, product = 0;
};

struct FoundUsb {
  UsbId id;
  std::string serial;   ///< printable ASCII; empty: none told
  std::string port;     ///< where it is plugged in, "1-2.3"
  std::string path;     ///< /dev/bus/usb/001/007
  std::string driver;   ///< the kernel's, of its first interface; empty: none
  std::string trouble;  ///< empty: it can be opened; else why not and what to do
};

/// Of these ids. `gives_way`: kernel drivers that may be taken off the device; with any other it is told as trouble.
[[nodiscard]] std::vector<FoundUsb> find_usb_devices(std::span<const UsbId> ids,
                                                     std::span<const std::string_view> gives_way);

/// Another process that has the file open, "name (pid)"; empty: none that this one may see. Looks through /proc.
[[nodiscard]] std::string other_user_of(const std::string& path);

}  // namespace farfeel::devices
