// What a link does to datagrams, as one line of text: "rtt=100ms jitter=5ms loss=1%,burst=4 rate=20Mbit".
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"

namespace farfeel::transport {

/// Both directions alike, and independent of each other. The default does nothing.
struct LinkSpec {
  std::int64_t round_trip_ns = 0;  ///< half of it each way
  /// Each datagram's delay is spread evenly over this much, centred on half the round trip, never below zero. Order is
  /// kept: one that would overtake waits, so under dense traffic delays lie towards the upper end.
  std::int64_t jitter_ns = 0;
  double loss = 0;            ///< mean share of datagrams lost [1]
  double burst = 1;           ///< mean number lost in a row; 1: each for itself
  double reorder = 0;         ///< share held back, out of the order, so that later ones overtake them [1]
  double duplicate = 0;       ///< share that arrives twice [1]
  double rate_bit_per_s = 0;  ///< of a bottleneck shared by all; 0: none
  /// Longest wait before the bottleneck; what would wait longer is dropped.
  std::int64_t queue_ns = 50'000'000;
  /// Longest IPv4 packet that passes, with its 28 bytes of headers; longer ones vanish without a word. 0: all pass.
  std::size_t mtu_bytes = 0;
};

/// Space-separated KEY=VALUE. Fails with the key, what is wrong with it, and what is allowed.
[[nodiscard]] tl::expected<LinkSpec, Error> parse_link_spec(const std::string& text);
/// The same link in words that parse_link_spec() reads; "" for one that does nothing.
[[nodiscard]] std::string to_string(const LinkSpec&);

}  // namespace farfeel::transport
