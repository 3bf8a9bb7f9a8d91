// Where the kernel put a HID device of these ids.
#pragma once

#include <cstdint>
#include <string>

namespace farfeel::hardware_lab {

/// "/dev/hidraw0"; empty: there is none.
[[nodiscard]] std::string hidraw_node(std::uint16_t vendor, std::uint16_t product);

/// "/dev/bus/usb/001/007"; empty: there is none.
[[nodiscard]] std::string usb_node(std::uint16_t vendor, std::uint16_t product);

}  // namespace farfeel::hardware_lab
