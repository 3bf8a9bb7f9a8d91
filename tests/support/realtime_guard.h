// A scope in which the calling thread may not allocate, free, lock a mutex or throw.
//
// Link farfeel_test_realtime_guard into a test: malloc and its family, pthread_mutex_lock and __cxa_allocate_exception
// are then this library's own, which count what happens inside a guarded scope and otherwise do what they always did.
#pragma once

#include <cstdint>
#include <string_view>

namespace farfeel::test_support {

class RealtimeGuard {
 public:
  RealtimeGuard() noexcept;
  ~RealtimeGuard();
  RealtimeGuard(const RealtimeGuard&) = delete;
  RealtimeGuard& operator=(const RealtimeGuard&) = delete;

  /// False under sanitizers, which need these functions themselves: skip the test and say so.
  [[nodiscard]] static bool is_available() noexcept;
  /// Forbidden calls made inside this thread's guarded scopes so far, and what the first one was.
  [[nodiscard]] static std::uint64_t violations() noexcept;
  [[nodiscard]] static std::string_view first_violation() noexcept;
};

}  // namespace farfeel::test_support
