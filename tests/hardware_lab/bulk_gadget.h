// An emulated Falcon as a real USB device: FunctionFS hands its control requests and bulk bytes to this process.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

#include "tests/hardware_lab/usb_gadget.h"
#include "tests/support/devices/falcon_emulator.h"

namespace farfeel::hardware_lab {

class BulkGadget {
 public:
  /// The emulator outlives it.
  BulkGadget(test_support::FalconEmulator& emulator, const UsbIdentity& identity);
  ~BulkGadget();
  BulkGadget(const BulkGadget&) = delete;
  BulkGadget& operator=(const BulkGadget&) = delete;

  void plug_in(bool is_stranger = false);
  std::int64_t pull_out();
  /// Both endpoints refuse from now on until the device is pulled out.
  void stall();
  /// To be held while the emulator is asked or told anything.
  [[nodiscard]] std::mutex& mutex() { return mutex_; }

 private:
  void answer_control();
  void give();
  void take();

  test_support::FalconEmulator& emulator_;
  UsbGadget gadget_;
  int control_fd_ = -1, in_fd_ = -1, out_fd_ = -1;
  std::mutex mutex_;
  std::atomic<bool> is_in_{false}, is_over_{false}, is_stalled_{false};
  std::thread controller_, giver_, taker_;
};

}  // namespace farfeel::hardware_lab
