#include "transport/lane/replay_window.h"

#include <algorithm>

namespace farfeel::transport {

LaneCounters operator+(const LaneCounters& a, const LaneCounters& b) noexcept {
  return {a.sent + b.sent,
          a.received + b.received,
          a.lost + b.lost,
          a.late + b.late,
          a.duplicate + b.duplicate,
          a.bursts + b.bursts,
          std::max(a.longest_burst, b.longest_burst)};
}

// Differences only, never sums: newest_ + 1 would wrap at 2^64.
ReplayWindow::Verdict ReplayWindow::accept(std::uint64_t counter) noexcept {
  if (!has_any_ || counter > newest_) {
    const std::uint64_t skipped = has_any_ ? counter - newest_ - 1 : counter;  // a key's counters begin at 0
    if (!has_any_ || skipped >= kRemembered) {
      seen_.reset();
    } else {
      for (std::uint64_t back = 1; back <= skipped; ++back) seen_.reset((counter - back) % kRemembered);
    }
    seen_.set(counter % kRemembered);
    newest_ = counter;
    has_any_ = true;
    ++counters_.received;
    counters_.lost += skipped;
    counters_.bursts += skipped > 0 ? 1 : 0;
    counters_.longest_burst = std::max(counters_.longest_burst, skipped);
    return Verdict::kNewest;
  }
  if (newest_ - counter >= kRemembered || seen_.test(counter % kRemembered)) {
    ++counters_.duplicate;
    return Verdict::kDuplicate;
  }
  seen_.set(counter % kRemembered);
  ++counters_.received;
  ++counters_.late;
  --counters_.lost;
  return Verdict::kLate;
}

}  // namespace farfeel::transport
