// One writer, one reader, the newest value wins; neither ever waits.
//
// A triple buffer: the writer owns one slot, the reader one, and the third is swapped between them with one atomic
// exchange. Values between two reads are skipped, never torn.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace farfeel::realtime {

/// Wait-free for one writer thread and one reader thread. T is copied; give it a fixed size for use in a tick.
template <typename T>
class LatestValue {
  static_assert(std::is_copy_assignable_v<T>);

 public:
  LatestValue() = default;
  explicit LatestValue(const T& initial) : slots_{initial, initial, initial} {}
  LatestValue(const LatestValue&) = delete;
  LatestValue& operator=(const LatestValue&) = delete;

  /// Writer only. Wait-free.
  void store(const T& value) noexcept(std::is_nothrow_copy_assignable_v<T>) {
    slots_[write_] = value;
    write_ = shared_.exchange(static_cast<std::uint8_t>(write_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  /// Reader only: takes over the newest value, if there is one newer than the last. Wait-free.
  /// Returns whether there was; latest() then refers to it.
  bool refresh() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    read_ = shared_.exchange(read_, std::memory_order_acq_rel) & kIndex;
    return true;
  }

  /// Reader only: the value of the last refresh(), or the initial one. Stays valid until the next refresh().
  [[nodiscard]] const T& latest() const noexcept { return slots_[read_]; }

 private:
  static constexpr std::uint8_t kIndex = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  alignas(64) std::uint8_t write_ = 0;
  alignas(64) std::atomic<std::uint8_t> shared_{1};
  alignas(64) std::uint8_t read_ = 2;
};

}  // namespace farfeel::realtime
