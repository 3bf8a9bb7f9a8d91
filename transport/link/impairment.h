// When each datagram of one direction leaves the link, if it does. Seeded; time is an argument; no sockets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>

#include "transport/link/link_spec.h"

namespace farfeel::transport {

class Impairment {
 public:
  struct Counters {
    std::uint64_t received = 0, lost = 0, queue_dropped = 0, too_long = 0, held_back = 0, duplicated = 0;
  };

  /// Equal specs and seeds give equal fates for equal arrivals.
  Impairment(const LinkSpec& spec, std::uint64_t seed) : spec_(spec), random_(seed) {}

  /// The times at which copies of a datagram leave that arrived at now_ns: none, one or two of them. now_ns never goes
  /// back. The result is valid until the next call.
  [[nodiscard]] std::span<const std::int64_t> releases(std::int64_t now_ns, std::size_t bytes);
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] double uniform();  ///< [0, 1)
  [[nodiscard]] bool is_lost();
  [[nodiscard]] std::int64_t delay_ns();

  LinkSpec spec_;
  std::mt19937_64 random_;
  bool is_in_burst_ = false;
  std::int64_t bottleneck_free_ns_ = 0;
  std::int64_t last_in_order_ns_ = 0;
  std::array<std::int64_t, 2> releases_{};
  Counters counters_;
};

}  // namespace farfeel::transport
