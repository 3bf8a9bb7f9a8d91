// A thread that does one thing at a fixed rate, and knows how late it was.
//
// Sleeping wakes tens of microseconds late; spinning all the time runs into the kernel's throttle of real-time threads
// (stalls of 50 ms). So it sleeps until a little before the deadline, then spins.
#pragma once

#include <atomic>
#include <cstdint>

#include "haptic_core/realtime/histogram.h"

namespace farfeel::realtime {

/// CLOCK_MONOTONIC [ns].
[[nodiscard]] std::int64_t monotonic_now_ns() noexcept;

/// The deadlines start, start + period, ... A tick that ends after the next deadline loses the deadlines it overran:
/// they are counted and never made up for in a burst. Time is an argument: nothing here reads a clock.
class Deadlines {
 public:
  Deadlines(std::int64_t first_ns, std::int64_t period_ns) : current_ns_(first_ns), period_ns_(period_ns) {}

  [[nodiscard]] std::int64_t current_ns() const noexcept { return current_ns_; }
  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }
  /// Moves on to the first deadline that is still ahead of now (or is now), at least one period on.
  void advance(std::int64_t now_ns) noexcept;

 private:
  std::int64_t current_ns_;
  std::int64_t period_ns_;
  std::uint64_t missed_ = 0;
};

struct PeriodicSettings {
  std::int64_t period_ns = 1'000'000;
  std::int64_t spin_ns = 60'000;  ///< how long before the deadline sleeping ends
  int fifo_priority = 40;         ///< SCHED_FIFO priority asked for; 0: stay an ordinary thread
};

/// Whether the calling thread now runs under SCHED_FIFO at that priority. False: not allowed here, nothing changed.
bool use_fifo(int priority) noexcept;

/// Locks the process's memory (what is there, and what comes where no limit forbids), and touches the calling thread's
/// stack, so that a tick meets no page fault. False: locking is not allowed here; the stack was touched all the same.
bool lock_memory() noexcept;

/// Threads that begin later have a stack that suffices for all that is done here, whatever `ulimit -s` says. Call it
/// before the first one begins.
void give_threads_room() noexcept;

struct TickTiming {
  std::int64_t deadline_ns;       ///< this tick's, on CLOCK_MONOTONIC
  std::int64_t wake_ns;           ///< how late it began
  std::int64_t previous_work_ns;  ///< how long the tick before worked
  std::uint64_t missed;           ///< deadlines lost so far
};

/// What a periodic loop learnt about itself. Read it when the loop has ended.
struct PeriodicStatistics {
  Histogram wake_ns;  ///< from deadline to the start of the tick
  Histogram work_ns;  ///< from the start of the tick to its end
  std::uint64_t missed = 0;
  bool is_fifo = false;
  bool is_memory_locked = false;
  std::int64_t page_faults = 0;  ///< of this thread during the ticks, the first 100 ticks aside
};

/// Sleeps, then spins, until the deadline. Returns the time it is then.
std::int64_t wait_until(std::int64_t deadline_ns, std::int64_t spin_ns) noexcept;
/// Minor and major page faults of the calling thread so far.
[[nodiscard]] std::int64_t thread_page_faults() noexcept;

/// Calls tick(const TickTiming&) at the rate until `stop` is set, on the calling thread.
template <typename Tick>
void run_periodically(const PeriodicSettings& settings, const std::atomic<bool>& stop, PeriodicStatistics& statistics,
                      Tick&& tick) {
  constexpr std::uint64_t kWarmUpTicks = 100;
  statistics.is_memory_locked = lock_memory();
  statistics.is_fifo = settings.fifo_priority > 0 && use_fifo(settings.fifo_priority);
  Deadlines deadlines(monotonic_now_ns() + settings.period_ns, settings.period_ns);
  std::int64_t work_ns = 0, faults_before = 0;
  while (!stop.load(std::memory_order_relaxed)) {
    const std::int64_t begin_ns = wait_until(deadlines.current_ns(), settings.spin_ns);
    const std::int64_t wake_ns = begin_ns - deadlines.current_ns();
    tick(TickTiming{deadlines.current_ns(), wake_ns, work_ns, deadlines.missed()});
    const std::int64_t end_ns = monotonic_now_ns();
    work_ns = end_ns - begin_ns;
    statistics.wake_ns.add(wake_ns);
    statistics.work_ns.add(work_ns);
    if (statistics.work_ns.count() == kWarmUpTicks) faults_before = thread_page_faults();
    deadlines.advance(end_ns);
  }
  statistics.missed = deadlines.missed();
  if (statistics.work_ns.count() >= kWarmUpTicks) statistics.page_faults = thread_page_faults() - faults_before;
}

}  // namespace farfeel::realtime
