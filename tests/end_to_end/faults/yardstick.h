// How late this machine wakes a thread that sleeps: what every figure of a wall clock here is off by, and more where
// several threads must wake one after the other.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "transport/net/arrival_clock.h"

namespace farfeel::end_to_end {

/// A thread was to run at due_ns, and ran at woke_ns.
struct Stall {
  std::int64_t due_ns, woke_ns;
};

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
  /// Whether it noted anything then or later. Until then it may be late without having told.
  [[nodiscard]] bool has_noted_since(std::int64_t then_ns) {
    const std::lock_guard lock(mutex_);
    return !lates_.empty() && lates_.back().now_ns >= then_ns;
  }
  /// All those above it.
  void add_stalls(std::int64_t above_ns, std::vector<Stall>& to) {
    const std::lock_guard lock(mutex_);
    for (const Late& late : lates_) {
      if (late.by_ns > above_ns) to.push_back({late.now_ns - late.by_ns, late.now_ns});
    }
  }

 private:
  struct Late {
    std::int64_t now_ns, by_ns;
  };
  static constexpr std::size_t kRemembered = 60'000;  // a minute at 1 kHz
  std::mutex mutex_;
  std::deque<Late> lates_;
};

/// Threads that do nothing but sleep for 1 ms at a time, one on each processor, since each may be taken away by itself.
/// They run before what is tested, where that is allowed: then they are late by the machine's fault alone.
class Yardstick {
 public:
  Yardstick() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    sched_getaffinity(0, sizeof allowed, &allowed);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (CPU_ISSET(cpu, &allowed)) sleepers_.emplace_back();
    }
    auto sleeper = sleepers_.begin();
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &allowed)) continue;
      sleeper->thread = std::thread([this, cpu, &lateness = sleeper->lateness] { run(cpu, lateness); });
      ++sleeper;
    }
  }
  ~Yardstick() {
    is_over_ = true;
    for (Sleeper& sleeper : sleepers_) sleeper.thread.join();
  }
  Yardstick(const Yardstick&) = delete;
  Yardstick& operator=(const Yardstick&) = delete;

  [[nodiscard]] std::int64_t worst_since_ns(std::int64_t then_ns) {
    std::int64_t worst_ns = 0;
    for (Sleeper& sleeper : sleepers_) worst_ns = std::max(worst_ns, sleeper.lateness.worst_since_ns(then_ns));
    return worst_ns;
  }
  /// Whether every sleeper woke then or later.
  [[nodiscard]] bool has_woken_since(std::int64_t then_ns) {
    return std::all_of(sleepers_.begin(), sleepers_.end(),
                       [&](Sleeper& sleeper) { return sleeper.lateness.has_noted_since(then_ns); });
  }
  [[nodiscard]] std::vector<Stall> stalls(std::int64_t above_ns) {
    std::vector<Stall> all;
    for (Sleeper& sleeper : sleepers_) sleeper.lateness.add_stalls(above_ns, all);
    return all;
  }
  /// Whether what is tested cannot be why a sleeper is late.
  [[nodiscard]] bool comes_first() const { return comes_first_; }

 private:
  static constexpr std::int64_t kPeriod_ns = 1'000'000;
  static constexpr int kPriority = 50;  // a haptic loop asks for 40
  struct Sleeper {
    Lateness lateness;
    std::thread thread;
  };

  void run(int cpu, Lateness& lateness) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    pthread_setaffinity_np(pthread_self(), sizeof one, &one);
    const sched_param first{.sched_priority = kPriority};
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &first) != 0) comes_first_ = false;
    while (!is_over_) {
      const std::int64_t due_ns = transport::monotonic_ns() + kPeriod_ns;
      const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
      const std::int64_t woke_ns = transport::monotonic_ns();
      lateness.note(woke_ns, woke_ns - due_ns);
    }
  }

  std::deque<Sleeper> sleepers_;  // whose places stay
  std::atomic<bool> is_over_{false}, comes_first_{true};
};

}  // namespace farfeel::end_to_end
