// The emulated Falcon as a usbfs node under umockdev, with the sysfs that the kernel would give it: what libusb finds,
// opens, claims and submits transfers to is its own code, unmodified.
//
// umockdev's node is a plain file. poll() on it returns at once for ever, so that who waits for it spins; and it can be
// read, so that libusb can wrap its descriptor. As a FIFO (kept full, drained while a transfer can be reaped) it waits
// as the kernel's does, but cannot be wrapped. Tests take either.
#pragma once

#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/falcon_emulator.h"

namespace farfeel::test_support {

class EmulatedUsbfs {
 public:
  enum class Node : std::uint8_t { kFile, kFifo };

  /// Plugged in from here on, as bus 1, this address, on port 1-<address>.
  EmulatedUsbfs(MockDevices&, FalconEmulator&, int address, Node node = Node::kFile);
  ~EmulatedUsbfs();
  EmulatedUsbfs(const EmulatedUsbfs&) = delete;
  EmulatedUsbfs& operator=(const EmulatedUsbfs&) = delete;

  [[nodiscard]] std::string path() const;  ///< /dev/bus/usb/001/<address>
  [[nodiscard]] std::string file() const;  ///< where it lies in truth, for chmod
  void unplug();
  void bind_driver(const std::string& driver);  ///< the kernel's, in sysfs
  /// Another program has claimed it.
  void claim_elsewhere(bool is_claimed) { is_claimed_elsewhere_ = is_claimed; }
  [[nodiscard]] int halts_cleared() const { return halts_cleared_; }

  /// The emulator has a thread of its own here: it is looked at and moved between these two.
  template <typename Look>
  auto with_device(Look look) {
    const std::lock_guard lock(mutex_);
    return look();
  }

 private:
  struct Transfer;
  static int on_ioctl(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);
  long answer(_UMockdevIoctlClient*, unsigned long request, int& error);
  long submit(_UMockdevIoctlClient*, int& error);
  long reap(_UMockdevIoctlClient*, int& error);
  long discard(_UMockdevIoctlClient*, int& error);
  long bulk(_UMockdevIoctlClient*, int& error);
  void complete(Transfer&, int status, int bytes);
  void pump();       // ends reads that the device has something for
  void show_poll();  // fills or drains the FIFO

  MockDevices& mock_;
  FalconEmulator& device_;
  const int address_;
  const Node node_;
  std::string usb_, interface_;  // in sysfs
  _UMockdevIoctlBase* answers_ = nullptr;
  int fifo_ = -1;
  bool is_fifo_full_ = false;
  std::recursive_mutex mutex_;
  std::deque<Transfer> under_way_, ended_;
  bool is_claimed_ = false;
  std::atomic<bool> is_gone_{false}, is_ending_{false}, is_claimed_elsewhere_{false};
  std::atomic<int> halts_cleared_{0};
  std::thread pump_;
};

}  // namespace farfeel::test_support
