// How long a datagram may be on this path: 1,232 bytes, or 1,200 where the longer ones vanish and the shorter pass.
// One thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "transport/bulk/bulk_messages.h"

namespace farfeel::transport {

class PathLimit {
 public:
  /// most: what the caller allows, kLargeDatagram or kSmallDatagram.
  explicit PathLimit(std::size_t most = kLargeDatagram) : most_(most) {}

  /// For the next message, sealing not counted.
  [[nodiscard]] std::size_t message_bytes() const {
    return (is_small_ || is_in_doubt() ? kSmallDatagram : most_) - kSealedBytes;
  }
  [[nodiscard]] std::size_t datagram_bytes() const { return is_small_ ? kSmallDatagram : most_; }
  /// Whether one padded to full length should be tried, on a path that once let none through.
  [[nodiscard]] bool wants_probe(std::int64_t now_ns) const {
    return is_small_ && most_ > kSmallDatagram && now_ns - tried_ns_ > kTryAgain_ns;
  }
  void on_probe(std::int64_t now_ns) { tried_ns_ = now_ns; }

  void on_sent() { ++sent_; }
  void on_arrived(bool is_large) {
    if (is_large) {
      lost_ = passed_ = 0;
      is_small_ = false;
    } else if (lost_ > 0) {
      ++passed_;
    }
  }
  void on_lost(bool is_large, std::int64_t now_ns) {
    if (is_small_ || !is_large) return;
    ++lost_;
    if (lost_ < kLost || passed_ < kPassed) return;
    is_small_ = true;
    tried_ns_ = now_ns;
  }
  void restart() { *this = PathLimit(most_); }

 private:
  static constexpr int kDoubt = 4, kLost = 8, kPassed = 3;  // a burst of loss takes some large ones, and small ones too
  static constexpr std::uint64_t kLargeEvery = 4;           // in doubt, so many small ones for each large one
  static constexpr std::int64_t kTryAgain_ns = 60'000'000'000;
  [[nodiscard]] bool is_in_doubt() const { return lost_ >= kDoubt && sent_ % kLargeEvery != 0; }

  std::size_t most_;
  int lost_ = 0, passed_ = 0;  // large ones lost in a row; small ones that passed since
  bool is_small_ = false;
  std::uint64_t sent_ = 0;
  std::int64_t tried_ns_ = 0;
};

}  // namespace farfeel::transport
