#include "haptic_core/realtime/periodic_loop.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <array>

namespace farfeel::realtime {
namespace {

constexpr std::size_t kStackTouched = 256 * 1024;     // far more than a tick uses
constexpr std::size_t kLeastStack = 2 * 1024 * 1024;  // far more than that

timespec timespec_from(std::int64_t time_ns) {
  return {time_ns / 1'000'000'000, time_ns % 1'000'000'000};
}

[[gnu::noinline]] void touch_stack() noexcept {
  std::array<char, kStackTouched> pages;
  for (std::size_t i = 0; i < kStackTouched; i += 1024) *static_cast<volatile char*>(&pages[i]) = 0;
}

}  // namespace

std::int64_t monotonic_now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

void Deadlines::advance(std::int64_t now_ns) noexcept {
  current_ns_ += period_ns_;
  if (now_ns <= current_ns_) return;
  const std::int64_t overrun = (now_ns - current_ns_ + period_ns_ - 1) / period_ns_;
  missed_ += static_cast<std::uint64_t>(overrun);
  current_ns_ += overrun * period_ns_;
}

bool use_fifo(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

bool lock_memory() noexcept {
  prctl(PR_SET_TIMERSLACK, 1);  // ordinary threads otherwise wake up to 50 us late
  // Under a limit, MCL_FUTURE would make some later allocation of another thread fail.
  rlimit limit{};
  const bool is_unlimited =
      geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  const bool is_locked = mlockall(is_unlimited ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0;
  touch_stack();
  return is_locked;
}

void give_threads_room() noexcept {
  pthread_attr_t common;
  if (pthread_getattr_default_np(&common) != 0) return;
  std::size_t stack = 0;
  if (pthread_attr_getstacksize(&common, &stack) == 0 && stack < kLeastStack &&
      pthread_attr_setstacksize(&common, kLeastStack) == 0)
    pthread_setattr_default_np(&common);
  pthread_attr_destroy(&common);
}

std::int64_t wait_until(std::int64_t deadline_ns, std::int64_t spin_ns) noexcept {
  std::int64_t now_ns = monotonic_now_ns();
  if (now_ns < deadline_ns - spin_ns) {
    const timespec wake = timespec_from(deadline_ns - spin_ns);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);  // a signal only makes the spin longer
    now_ns = monotonic_now_ns();
  }
  while (now_ns < deadline_ns) now_ns = monotonic_now_ns();
  return now_ns;
}

std::int64_t thread_page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

}  // namespace farfeel::realtime
