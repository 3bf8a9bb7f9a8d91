#include "transport/sequence_window.h"

namespace farfeel::transport {

LaneCounters operator+(const LaneCounters& a, const LaneCounters& b) noexcept {
  return {a.sent + b.sent, a.received + b.received, a.lost + b.lost, a.late + b.late, a.duplicate + b.duplicate};
}

SequenceWindow::Verdict SequenceWindow::accept(std::uint32_t sequence) noexcept {
  if (sequence == 0) return Verdict::kAbsurd;
  if (sequence > newest_) {
    const std::uint32_t jump = sequence - newest_;
    if (jump > kMaxJump) return Verdict::kAbsurd;
    if (jump >= kRemembered) {
      seen_.reset();
    } else {
      for (std::uint32_t s = newest_ + 1; s != sequence; ++s) seen_.reset(s % kRemembered);
    }
    seen_.set(sequence % kRemembered);
    newest_ = sequence;
    ++counters_.received;
    counters_.lost += jump - 1;
    return Verdict::kNewest;
  }
  if (newest_ - sequence >= kRemembered || seen_.test(sequence % kRemembered)) {
    ++counters_.duplicate;
    return Verdict::kDuplicate;
  }
  seen_.set(sequence % kRemembered);
  ++counters_.received;
  ++counters_.late;
  --counters_.lost;
  return Verdict::kLate;
}

}  // namespace farfeel::transport
