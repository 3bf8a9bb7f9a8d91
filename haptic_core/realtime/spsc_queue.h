// A bounded queue from one thread to one other; it never waits, and what does not fit is dropped and counted.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace farfeel::realtime {

/// Wait-free for one writer thread and one reader thread. Memory is taken once, in the constructor, and touched there.
template <typename T>
class SpscQueue {
  static_assert(std::is_nothrow_copy_assignable_v<T>);

 public:
  /// Holds at least `capacity` values: the next power of two.
  explicit SpscQueue(std::size_t capacity) : slots_(std::bit_ceil(std::max<std::size_t>(capacity, 1))) {}
  SpscQueue(const SpscQueue&) = delete;
  SpscQueue& operator=(const SpscQueue&) = delete;

  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }

  /// Writer only. Wait-free. False when the queue is full: the value is dropped and counted.
  bool push(const T& value) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == slots_.size()) {
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ == slots_.size()) {
        dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return false;
      }
    }
    slots_[tail & (slots_.size() - 1)] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Reader only. Wait-free. Returns whether there was a value; it is then in `value`.
  bool pop(T& value) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    value = slots_[head & (slots_.size() - 1)];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Any thread: how many values were dropped so far.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  std::vector<T> slots_;
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // values ever pushed
  std::uint64_t head_seen_ = 0;                     // the writer's last look at head_
  std::atomic<std::uint64_t> dropped_{0};
  alignas(64) std::atomic<std::uint64_t> head_{0};  // values ever popped
};

}  // namespace farfeel::realtime
