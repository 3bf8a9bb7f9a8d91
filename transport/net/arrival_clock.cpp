#include "transport/net/arrival_clock.h"

#include <algorithm>
#include <cstdlib>
#include <ctime>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr int kReadings = 3;                          // one may be interrupted between its clocks; three hardly are
constexpr std::int64_t kNarrow_ns = 1'000;            // a reading this narrow is good enough
constexpr std::int64_t kClockNoise_ns = 1'000;        // by which the difference of the clocks may be misread
constexpr std::int64_t kStampToQueue_ns = 1'000'000;  // from the stamp until it lies in the socket, another core's work

std::int64_t now_ns(clockid_t clock) noexcept {
  timespec t{};
  clock_gettime(clock, &t);
  return t.tv_sec * kNsPerSecond + t.tv_nsec;
}

}  // namespace

std::int64_t monotonic_ns() noexcept {
  return now_ns(CLOCK_MONOTONIC);
}

std::int64_t wall_clock_ns() noexcept {
  return now_ns(CLOCK_REALTIME);
}

ClockReading read_clocks() noexcept {
  ClockReading best;
  for (int attempt = 0; attempt < kReadings; ++attempt) {
    const std::int64_t before = now_ns(CLOCK_MONOTONIC);
    const std::int64_t realtime = now_ns(CLOCK_REALTIME);
    const std::int64_t after = now_ns(CLOCK_MONOTONIC);
    if (attempt == 0 || after - before < best.width_ns)
      best = {before + (after - before) / 2, realtime, after - before};
    if (best.width_ns <= kNarrow_ns) break;
  }
  return best;
}

ArrivalClock::ArrivalClock(const ClockReading& now) noexcept
    : floor_ns_(now.monotonic_ns), offset_ns_(now.realtime_ns - now.monotonic_ns), former_offset_ns_(offset_ns_) {}

ArrivalClock::Arrival ArrivalClock::arrival(std::int64_t stamp_realtime_ns, const ClockReading& now) noexcept {
  const std::int64_t tolerance = now.width_ns + kClockNoise_ns;
  const std::int64_t offset = now.realtime_ns - now.monotonic_ns;
  if (std::abs(offset - offset_ns_) > tolerance) {
    was_stepped_again_ = has_former_;
    former_offset_ns_ = offset_ns_;
    offset_ns_ = offset;
    has_former_ = true;
  }
  const auto fits = [&](std::int64_t time_ns) {
    return time_ns >= floor_ns_ - kStampToQueue_ns && time_ns <= now.monotonic_ns + tolerance;
  };
  const std::int64_t time = stamp_realtime_ns - offset_ns_, former_time = stamp_realtime_ns - former_offset_ns_;
  const bool time_fits = fits(time), former_fits = has_former_ && fits(former_time);
  if (time_fits == former_fits || was_stepped_again_) return {now.monotonic_ns, false};
  if (time_fits) has_former_ = false;  // those behind it in the socket were stamped after the step, too
  floor_ns_ = std::min(time_fits ? time : former_time, now.monotonic_ns);
  return {floor_ns_, true};
}

void ArrivalClock::note_empty(std::int64_t monotonic_ns) noexcept {
  floor_ns_ = monotonic_ns;
  has_former_ = was_stepped_again_ = false;
}

}  // namespace farfeel::transport
