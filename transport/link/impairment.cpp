#include "transport/link/impairment.h"

#include <algorithm>
#include <cmath>

namespace farfeel::transport {
namespace {

// How far out of its turn a held-back datagram or a second copy comes: a few haptic periods.
constexpr std::int64_t kLeastHold_ns = 2'000'000, kMostHold_ns = 6'000'000;
constexpr std::size_t kHeaderBytes = 20 + 8;  // of IPv4 and UDP

}  // namespace

// The standard library's engines are the same everywhere, its distributions are not.
double Impairment::uniform() {
  return static_cast<double>(random_() >> 11) * 0x1p-53;
}

// Gilbert and Elliott's two states, with everything lost in the bad one. Let r be the chance to leave the bad state and
// q the chance to enter it: bursts last 1 / r on average, and the mean loss is q / (q + r), so q = p r / (1 - p).
bool Impairment::is_lost() {
  const double p = spec_.loss;
  if (p <= 0) return false;
  if (p >= 1) return true;
  if (spec_.burst <= 1) return uniform() < p;
  const double r = 1 / spec_.burst, q = p * r / (1 - p);
  is_in_burst_ = is_in_burst_ ? uniform() >= r : uniform() < q;
  return is_in_burst_;
}

std::int64_t Impairment::delay_ns() {
  double delay = static_cast<double>(spec_.round_trip_ns) / 2;
  if (spec_.jitter_ns > 0) delay += (uniform() - 0.5) * static_cast<double>(spec_.jitter_ns);
  return std::max<std::int64_t>(0, std::llround(delay));
}

std::span<const std::int64_t> Impairment::releases(std::int64_t now_ns, std::size_t bytes) {
  ++counters_.received;
  if (spec_.mtu_bytes > 0 && bytes + kHeaderBytes > spec_.mtu_bytes) {
    ++counters_.too_long;
    return {};
  }
  std::int64_t sent_ns = now_ns;
  if (spec_.rate_bit_per_s > 0) {
    sent_ns = std::max(now_ns, bottleneck_free_ns_);
    if (sent_ns - now_ns > spec_.queue_ns) {
      ++counters_.queue_dropped;
      return {};
    }
    sent_ns += std::llround(static_cast<double>(bytes) * 8e9 / spec_.rate_bit_per_s);
    bottleneck_free_ns_ = sent_ns;
  }
  if (is_lost()) {
    ++counters_.lost;
    return {};
  }
  const auto hold = [this] {
    return kLeastHold_ns + std::llround(uniform() * static_cast<double>(kMostHold_ns - kLeastHold_ns));
  };
  std::size_t copies = 1;
  if (spec_.reorder > 0 && uniform() < spec_.reorder) {
    ++counters_.held_back;
    releases_[0] = sent_ns + delay_ns() + spec_.jitter_ns + hold();
  } else {
    last_in_order_ns_ = std::max(last_in_order_ns_, sent_ns + delay_ns());
    releases_[0] = last_in_order_ns_;
  }
  if (spec_.duplicate > 0 && uniform() < spec_.duplicate) {
    ++counters_.duplicated;
    releases_[copies++] = releases_[0] + hold();
  }
  return std::span(releases_).first(copies);
}

}  // namespace farfeel::transport
