// An emulated joystick as an input node under umockdev. As the hidraw one, its node is a FIFO with one byte for each
// event that waits, and reads, writes and ioctls are answered by the emulator.
#pragma once

#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "tests/support/devices/emulated_hidraw.h"
#include "tests/support/devices/force_joystick_emulator.h"

namespace farfeel::test_support {

class EmulatedEvdev {
 public:
  /// Plugged in from here on, as /dev/input/event<number>.
  EmulatedEvdev(MockDevices&, devices::ForceJoystickEmulator&, int number);
  ~EmulatedEvdev();
  EmulatedEvdev(const EmulatedEvdev&) = delete;
  EmulatedEvdev& operator=(const EmulatedEvdev&) = delete;

  [[nodiscard]] std::string path() const { return "/dev/input/" + node_; }
  [[nodiscard]] std::string sysfs() const { return mock_.root() + "/sys/class/input"; }
  void unplug();
  /// The reader is told that events were dropped, and gets none of those that waited.
  void overflow();
  /// The emulator has a thread of its own here: it is looked at and moved between these two.
  template <typename Look>
  auto with_device(Look look) {
    const std::lock_guard lock(mutex_);
    return look();
  }

 private:
  void pump();
  void queue(const input_event&);  // at mutex_
  long answer(unsigned long request, std::span<std::byte> memory);
  static int on_ioctl(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);
  static int on_read(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);
  static int on_write(_UMockdevIoctlBase*, _UMockdevIoctlClient*, void* self);

  MockDevices& mock_;
  devices::ForceJoystickEmulator& device_;
  std::string node_;
  _UMockdevIoctlBase* answers_ = nullptr;
  int fifo_ = -1;
  std::mutex mutex_;
  std::deque<input_event> waiting_;  // at mutex_, as device_
  std::atomic<bool> is_gone_ = false, is_ending_ = false;
  std::thread pump_;
};

}  // namespace farfeel::test_support
