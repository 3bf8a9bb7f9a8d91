// What the haptic thread saw, for the thread that makes the faults: when answers came, and every rule that was broken.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/end_to_end/faults/yardstick.h"

namespace farfeel::end_to_end {

class Watch {
 public:
  /// The newest run of the slave that was started.
  std::atomic<std::uint32_t> run{0};
  std::atomic<double> push_N{0};                    ///< of the contacts on the tool, in the newest tick
  std::atomic<double> image_off_m{0};               ///< how far the loop holds the hand's image from the hand
  std::atomic<double> largest_step_N{0};            ///< of the hand's force from tick to tick, per tick that was due
  std::atomic<std::uint64_t> answers{0}, tiles{0};  ///< that were checked

  Lateness ticks;  ///< of the haptic thread

  /// An answer to a pose that was sent then has come.
  void note_answer(std::int64_t sent_ns, std::int64_t arrived_ns) {
    const std::lock_guard lock(mutex_);
    arrivals_.push_back({sent_ns, arrived_ns});
    if (arrivals_.size() > kRemembered) arrivals_.pop_front();
    answers.fetch_add(1, std::memory_order_relaxed);
  }
  /// When the first answer came to a pose that was sent at then_ns or later.
  [[nodiscard]] std::optional<std::int64_t> answered_since(std::int64_t then_ns) {
    const std::lock_guard lock(mutex_);
    std::optional<std::int64_t> first_ns;
    for (auto arrival = arrivals_.rbegin(); arrival != arrivals_.rend() && arrival->arrived_ns >= then_ns; ++arrival) {
      if (arrival->sent_ns >= then_ns) first_ns = arrival->arrived_ns;
    }
    return first_ns;
  }

  /// The force stepped. Whether that is the session's fault, who knows how late this machine was may say.
  struct Step {
    std::int64_t time_ns;
    std::string what;
  };
  void note_step(std::int64_t now_ns, std::string what) {
    const std::lock_guard lock(mutex_);
    if (steps_.size() < kMostWords) steps_.push_back({now_ns, std::move(what)});
  }
  [[nodiscard]] std::vector<Step> take_steps() {
    const std::lock_guard lock(mutex_);
    return std::exchange(steps_, {});
  }

  void violated(const std::string& what) {
    const std::lock_guard lock(mutex_);
    ++violations_;
    if (words_.size() < kMostWords) words_.push_back(what);
  }
  [[nodiscard]] std::uint64_t violations() {
    const std::lock_guard lock(mutex_);
    return violations_;
  }
  /// What was not taken yet.
  [[nodiscard]] std::vector<std::string> take_words() {
    const std::lock_guard lock(mutex_);
    return std::exchange(words_, {});
  }

 private:
  struct Arrival {
    std::int64_t sent_ns, arrived_ns;
  };
  static constexpr std::size_t kRemembered = 20'000, kMostWords = 20;
  std::mutex mutex_;
  std::deque<Arrival> arrivals_;
  std::uint64_t violations_ = 0;
  std::vector<std::string> words_;
  std::vector<Step> steps_;
};

}  // namespace farfeel::end_to_end
