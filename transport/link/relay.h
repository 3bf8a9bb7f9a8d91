// The link itself: a port in front, forwarded to the slave's, datagrams released when their impairment says so.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <queue>
#include <tl/expected.hpp>
#include <vector>

#include "transport/link/impairment.h"
#include "transport/net/udp_socket.h"

namespace farfeel::transport {

class Relay {
 public:
  struct Options {
    Address listen;  ///< what the master connects to; port 0 takes a free one
    Address slave;
    LinkSpec spec;
    std::uint64_t seed = 1;
  };
  /// How late datagrams left, against the moment their impairment gave [us].
  struct ReleaseError {
    std::uint64_t samples = 0;
    double p50_us = 0, p99_us = 0, p99_9_us = 0, max_us = 0;
    /// False when p99.9 is over 1 ms: what was measured over this link says more about this machine than about the
    /// link.
    [[nodiscard]] bool is_valid() const { return p99_9_us <= kMostRelease_us; }
    static constexpr double kMostRelease_us = 1000;
  };
  struct Direction {
    Impairment::Counters impairment;
    std::uint64_t sent = 0;      ///< copies that left
    std::uint64_t unsent = 0;    ///< copies the kernel refused, mostly because nobody listens there
    std::uint64_t overflow = 0;  ///< datagrams dropped because too many were pending
  };
  struct Summary {
    double seconds = 0;
    Direction up, down;  ///< up: towards the slave
    ReleaseError release_error;
    std::uint64_t refused_peers = 0;  ///< datagrams of more sockets than the link has room for
  };

  [[nodiscard]] static tl::expected<std::unique_ptr<Relay>, Error> open(const Options&);
  ~Relay();

  /// Forwards until stop is set or until_ns is past. A signal ends the wait early, so that stop is seen.
  void run(const std::atomic<bool>& stop, std::int64_t until_ns);
  [[nodiscard]] const Address& local() const;  ///< in front, with the real port
  [[nodiscard]] Summary summary() const;

 private:
  class State;
  explicit Relay(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One JSON object on one line.
[[nodiscard]] std::string to_json(const Relay::Options&, const Relay::Summary&);

}  // namespace farfeel::transport
