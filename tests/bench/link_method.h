// A way to carry a datagram there and back, for `farfeel-bench link`: two ends, each with one socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "tests/bench/two_ends.h"
#include "transport/seal/suite.h"

namespace farfeel::bench {

/// Used by one thread at a time.
class LinkEnd {
 public:
  virtual ~LinkEnd() = default;
  /// False if it could not be sent.
  virtual bool send(std::span<const std::byte> message) = 0;
  /// The size of the next message that waits, or 0. Never blocks.
  virtual std::size_t receive(std::span<std::byte> to) = 0;
  /// Sleeps until receive() may have something or until_ns (CLOCK_MONOTONIC) is past.
  virtual void wait_until(std::int64_t until_ns) = 0;
};

/// Both ends are at rest between turns.
class LinkMethod {
 public:
  virtual ~LinkMethod() = default;
  [[nodiscard]] virtual LinkEnd& master() = 0;
  [[nodiscard]] virtual LinkEnd& slave() = 0;
  virtual void begin_turn() {}
};

using MadeMethod = tl::expected<std::unique_ptr<LinkMethod>, std::string>;  ///< or why it cannot be had

/// A sealed lane as the haptic lane uses it: at the slave through the port that strangers reach, with the path watched.
[[nodiscard]] MadeMethod make_ours(const TwoEnds&, transport::Suite);
/// The system calls alone: two connected sockets, send and recv.
[[nodiscard]] MadeMethod make_raw_udp(const TwoEnds&);
/// ENet's unreliable packets, its throttle off. Nothing is sealed.
[[nodiscard]] MadeMethod make_enet(const TwoEnds&);
/// QUIC's DATAGRAM frames (RFC 9221) by ngtcp2 and GnuTLS, in a connection of their own, as a lane would have it.
[[nodiscard]] MadeMethod make_ngtcp2(const TwoEnds&, transport::Suite);

}  // namespace farfeel::bench
