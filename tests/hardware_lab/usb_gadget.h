// A USB device that this kernel makes (configfs, libcomposite) and plugs into its own emulated host (dummy_hcd).
//
// The kernel of the lab's guest alone: it needs root, and leaves what it made until it goes.
#pragma once

#include <cstdint>
#include <string>

namespace farfeel::hardware_lab {

struct UsbIdentity {
  std::uint16_t vendor = 0, product = 0;
  std::string manufacturer, name, serial;
};

/// Nanoseconds of CLOCK_MONOTONIC.
[[nodiscard]] std::int64_t now_ns();

/// Writes to a file of the kernel's; ends the program, saying why, where that fails.
void write_or_die(const std::string& path, const std::string& text);

class UsbGadget {
 public:
  /// function: of configfs, "ffs.falcon" or "hid.0"; its attributes are written by the caller before plug_in().
  UsbGadget(const std::string& name, const UsbIdentity& identity, const std::string& function);
  ~UsbGadget();
  UsbGadget(const UsbGadget&) = delete;
  UsbGadget& operator=(const UsbGadget&) = delete;

  [[nodiscard]] const std::string& function_path() const { return function_path_; }
  /// Once all of the function's attributes are written.
  void add_function();
  /// is_stranger: with ids that are nobody's haptic device.
  void plug_in(bool is_stranger = false);
  /// The kernel's disconnect begins after the time returned.
  std::int64_t pull_out();
  [[nodiscard]] bool is_plugged_in() const { return is_plugged_in_; }

 private:
  void tell_ids(std::uint16_t vendor, std::uint16_t product) const;

  std::string path_, function_path_, link_path_;
  std::uint16_t vendor_, product_;
  bool is_plugged_in_ = false;
};

}  // namespace farfeel::hardware_lab
