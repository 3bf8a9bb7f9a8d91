// How late this machine wakes a thread that sleeps: what every figure of a wall clock here is off by, and more where
// several threads must wake one after the other.
#pragma once

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>

#include "transport/net/arrival_clock.h"

namespace farfeel::end_to_end {

/// How late a thread was, lately. Any thread notes, any thread asks.
class Lateness {
 public:
  void note(std::int64_t now_ns, std::int64_t late_ns) {
    const std::lock_guard lock(mutex_);
    lates_.push_back({now_ns, late_ns});
    if (lates_.size() > kRemembered) lates_.pop_front();
  }
  [[nodiscard]] std::int64_t worst_since_ns(std::int64_t then_ns) {
    const std::lock_guard lock(mutex_);
    std::int64_t worst_ns = 0;
    for (auto late = lates_.rbegin(); late != lates_.rend() && late->now_ns >= then_ns; ++late)
      worst_ns = std::max(worst_ns, late->by_ns);
    return worst_ns;
  }

 private:
  struct Late {
    std::int64_t now_ns, by_ns;
  };
  static constexpr std::size_t kRemembered = 30'000;  // half a minute at 1 kHz
  std::mutex mutex_;
  std::deque<Late> lates_;
};

/// A thread that does nothing but sleep for 1 ms at a time.
class Yardstick {
 public:
  Yardstick() : thread_([this] { run(); }) {}
  ~Yardstick() {
    is_over_ = true;
    thread_.join();
  }
  Yardstick(const Yardstick&) = delete;
  Yardstick& operator=(const Yardstick&) = delete;

  [[nodiscard]] std::int64_t worst_since_ns(std::int64_t then_ns) { return lateness_.worst_since_ns(then_ns); }

 private:
  static constexpr std::int64_t kPeriod_ns = 1'000'000;

  void run() {
    while (!is_over_) {
      const std::int64_t due_ns = transport::monotonic_ns() + kPeriod_ns;
      const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
      const std::int64_t woke_ns = transport::monotonic_ns();
      lateness_.note(woke_ns, woke_ns - due_ns);
    }
  }

  Lateness lateness_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

}  // namespace farfeel::end_to_end
