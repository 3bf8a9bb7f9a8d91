// One writer, any readers, the newest value wins, in memory that two processes share.
//
// A sequence lock: odd while the writer is at it. Unlike a triple buffer it keeps nothing in the writer, so a writer
// that was killed at any instruction leaves what the next one can go on from, and readers what they had before.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace farfeel::realtime {

/// All-zero memory is a valid one, which holds nothing. The reader never waits for the writer.
template <typename T>
class SharedValue {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// The one writer. Wait-free.
  void store(const T& value) noexcept {
    Words words{};
    std::memcpy(words.data(), &value, sizeof(T));
    // One that was killed amid its work left an odd number: this is the next odd one either way.
    const std::uint64_t odd = (sequence_.load(std::memory_order_relaxed) + 1) | 1U;
    // Acquire: no word is written before the number is odd. Release on each word: who sees it sees that number, too.
    sequence_.exchange(odd, std::memory_order_acq_rel);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    sequence_.store(odd + 1, std::memory_order_release);
  }

  /// Copies the newest whole value to `value`; false, and `value` as it was, where there is none yet or the writer was
  /// at it in each of some tries.
  [[nodiscard]] bool load(T& value) const noexcept {
    for (int i = 0; i < kTries; ++i) {
      const std::uint64_t before = sequence_.load(std::memory_order_acquire);
      if (before == 0) return false;
      if ((before & 1U) != 0) continue;
      Words words;
      for (std::size_t w = 0; w < kWords; ++w) words[w] = words_[w].load(std::memory_order_acquire);
      if (sequence_.load(std::memory_order_relaxed) != before) continue;
      std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
      return true;
    }
    return false;
  }

 private:
  static constexpr int kTries = 8;  // the writer takes some 50 ns, and writes once a millisecond
  static constexpr std::size_t kWords = (sizeof(T) + 7) / 8;
  using Words = std::array<std::uint64_t, kWords>;
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

  alignas(64) std::atomic<std::uint64_t> sequence_;
  std::array<std::atomic<std::uint64_t>, kWords> words_;
};

}  // namespace farfeel::realtime
