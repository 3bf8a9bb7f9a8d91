// A HidEmulator as a real USB device: the kernel's own HID stack reads it (f_hid behind dummy_hcd).
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

#include "tests/hardware_lab/usb_gadget.h"
#include "tests/support/devices/hid_emulator.h"

namespace farfeel::hardware_lab {

class HidGadget {
 public:
  /// The emulator outlives it. report_bytes: of the longest report.
  HidGadget(test_support::HidEmulator& emulator, unsigned report_bytes);
  ~HidGadget();
  HidGadget(const HidGadget&) = delete;
  HidGadget& operator=(const HidGadget&) = delete;

  void plug_in(bool is_stranger = false);
  std::int64_t pull_out();
  /// To be held while the emulator is asked or told anything.
  [[nodiscard]] std::mutex& mutex() { return mutex_; }

 private:
  void give();  // input reports, a thread of its own
  void take();  // output reports

  test_support::HidEmulator& emulator_;
  UsbGadget gadget_;
  unsigned report_bytes_;
  bool numbers_reports_;
  int fd_ = -1;
  std::mutex mutex_;
  std::atomic<bool> is_in_{false}, is_over_{false};
  std::thread giver_, taker_;
};

}  // namespace farfeel::hardware_lab
