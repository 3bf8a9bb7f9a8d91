// Sleeping until any of several sockets has something to read, or until a time.
#pragma once

#include <poll.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <tl/expected.hpp>

#include "transport/error.h"

namespace farfeel::transport {

/// Wakes a thread that sleeps in a WaitSet. Any thread may signal; one waits. Movable.
class WakeEvent {
 public:
  [[nodiscard]] static tl::expected<WakeEvent, Error> open();
  WakeEvent(WakeEvent&& other) noexcept;
  WakeEvent& operator=(WakeEvent&& other) noexcept;
  ~WakeEvent();

  /// One system call that never blocks; realtime-safe, though it may cost some 10 us where it wakes another thread.
  void signal() const noexcept;
  /// So that the next wait sleeps again. WaitSet does this.
  void clear() const noexcept;
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  explicit WakeEvent(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

/// What one sleep waits for; made anew for each, on the stack. Realtime-safe but for the sleep itself.
class WaitSet {
 public:
  void add(int socket_descriptor) noexcept;  ///< ignored if negative
  void add(const WakeEvent&) noexcept;       ///< cleared when it ends the sleep; outlives the sleep
  /// False if until_ns (CLOCK_MONOTONIC) passed first, or a signal came. True may be a false alarm: read and sleep
  /// again.
  bool wait_until(std::int64_t until_ns) noexcept;

  static constexpr std::size_t kMost = 16;  ///< what is added beyond is a bug

 private:
  std::array<pollfd, kMost> polled_;
  std::array<const WakeEvent*, kMost> events_;
  std::size_t size_ = 0;
};

}  // namespace farfeel::transport
