// A duration below 2^kSubBits has its own bucket. Above, with e = floor(log2 d), the kSubBits bits after the leading
// one choose among 2^kSubBits buckets of width 2^(e - kSubBits): half a width is at most d / 2^(kSubBits + 1).
#include "haptic_core/realtime/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace farfeel::realtime {

std::size_t Histogram::bucket(std::uint64_t duration_ns) noexcept {
  constexpr std::uint64_t kSubBuckets = 1u << kSubBits;
  if (duration_ns < kSubBuckets) return static_cast<std::size_t>(duration_ns);
  const auto shift = static_cast<std::uint64_t>(std::bit_width(duration_ns)) - 1 - kSubBits;
  return shift * kSubBuckets + (duration_ns >> shift);
}

std::uint64_t Histogram::middle_ns(std::size_t bucket) noexcept {
  constexpr std::size_t kSubBuckets = 1u << kSubBits;
  if (bucket < kSubBuckets) return bucket;
  const std::size_t shift = bucket / kSubBuckets - 1;
  const std::uint64_t low = static_cast<std::uint64_t>(bucket - shift * kSubBuckets) << shift;
  return low + ((1ull << shift) >> 1);
}

void Histogram::add(std::int64_t duration_ns) noexcept {
  const std::int64_t duration = std::max<std::int64_t>(duration_ns, 0);
  ++counts_[bucket(static_cast<std::uint64_t>(duration))];
  ++count_;
  max_ns_ = std::max(max_ns_, duration);
  sum_ns_ += static_cast<double>(duration);
}

double Histogram::mean_ns() const noexcept {
  return count_ == 0 ? 0 : sum_ns_ / static_cast<double>(count_);
}

std::int64_t Histogram::quantile_ns(double q) const noexcept {
  if (count_ == 0) return 0;
  const double wanted = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
  const auto rank = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(wanted)));
  if (rank >= count_) return max_ns_;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    below += counts_[i];
    if (below >= rank) return std::min(static_cast<std::int64_t>(middle_ns(i)), max_ns_);
  }
  return max_ns_;
}

}  // namespace farfeel::realtime
