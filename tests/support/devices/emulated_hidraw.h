// An emulated HID device as a hidraw node under umockdev, with the sysfs that the kernel would give it.
//
// The node that umockdev makes is a plain file, on which poll() returns at once for ever. Here it is a FIFO that holds
// one byte a waiting report; reads are answered by the emulator, which take their byte with them.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/devices/hid_emulator.h"

struct _UMockdevTestbed;
struct _UMockdevIoctlBase;
struct _UMockdevIoctlClient;

namespace farfeel::test_support {

/// The /dev and /sys of one test. Needs umockdev's library preloaded (under_umockdev.h).
class MockDevices {
 public:
  MockDevices();
  ~MockDevices();
  MockDevices(const MockDevices&) = delete;
  MockDevices& operator=(const MockDevices&) = delete;
  [[nodiscard]] _UMockdevTestbed* testbed() const { return testbed_; }
  [[nodiscard]] std::string root() const;

 private:
  _UMockdevTestbed* testbed_;
};

class EmulatedHidraw {
 public:
  /// Plugged in from here on, as /dev/hidraw<number>.
  EmulatedHidraw(MockDevices&, HidEmulator&, int number);
  ~EmulatedHidraw();
  EmulatedHidraw(const EmulatedHidraw&) = delete;
  EmulatedHidraw& operator=(const EmulatedHidraw&) = delete;

  [[nodiscard]] std::string path() const { return "/dev/" + node_; }
  [[nodiscard]] std::string file() const;  ///< where the node lies in truth, for chmod
  void unplug();
  void stall_output(bool is_stalled) { is_stalled_ = is_stalled; }

  /// The emulator has a thread of its own here: it is looked at and moved between these two.
  template <typename Look>
  auto with_device(Look look) {
    const std::lock_guard lock(mutex_);
    return look();
  }

 private:
  void pump();  // what the device has to say, onto the queue, until is_ending_
  static int on_ioctl(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);
  static int on_read(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);
  static int on_write(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);

  MockDevices& mock_;
  HidEmulator& device_;
  std::string node_;
  std::vector<std::string> sysfs_;  // devices, the innermost last
  _UMockdevIoctlBase* answers_ = nullptr;
  int fifo_ = -1;
  std::mutex mutex_;
  std::deque<std::vector<std::byte>> waiting_;  // at mutex_, as device_
  std::atomic<bool> is_gone_ = false, is_stalled_ = false, is_ending_ = false;
  std::thread pump_;
};

}  // namespace farfeel::test_support
