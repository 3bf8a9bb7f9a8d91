// How long things took: a histogram of fixed memory whose buckets grow with the value.
#pragma once

#include <array>
#include <cstdint>

namespace farfeel::realtime {

/// Counts durations of 0 ns .. 2^63 ns. A quantile is right within 1/32 of itself; count, mean and maximum are exact.
/// One writer; read it from another thread only after the writer has stopped.
class Histogram {
 public:
  /// Realtime-safe. A negative duration counts as 0.
  void add(std::int64_t duration_ns) noexcept;

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::int64_t max_ns() const noexcept { return max_ns_; }
  [[nodiscard]] double mean_ns() const noexcept;
  /// The smallest bucket's middle below which a share `q` of the durations lies, 0 <= q <= 1. Never above max_ns(); 0
  /// when empty.
  [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept;

 private:
  static constexpr int kSubBits = 4;  // 16 buckets between a power of two and the next
  static constexpr std::size_t kBuckets = (63 - kSubBits + 1) << kSubBits;
  [[nodiscard]] static std::size_t bucket(std::uint64_t duration_ns) noexcept;
  [[nodiscard]] static std::uint64_t middle_ns(std::size_t bucket) noexcept;

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
  double sum_ns_ = 0;
};

}  // namespace farfeel::realtime
