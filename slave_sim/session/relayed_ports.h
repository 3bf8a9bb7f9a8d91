// The slave's two ports that a relay leads to, one a lane, beside the port that it listens on.
//
// A relay tells its ends apart by their addresses, so each lane has a port of its own there. What comes to one of these
// is a handshake or a lane's datagram as on the listening port, from the relay or, past it, from where the master's
// probes came; or it is the relay's own word, which ends here. A lane connects its socket to its peer on whichever port
// that came to (transport/net/lane_socket.h).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "transport/net/datagram.h"
#include "transport/net/udp_socket.h"
#include "transport/net/wait_set.h"
#include "transport/relay/relay_access.h"
#include "transport/seal/handshake_messages.h"

namespace farfeel::slave_sim {

/// One thread uses it, the io thread.
class RelayedPorts {
 public:
  [[nodiscard]] static tl::expected<RelayedPorts, transport::Error> open(const transport::RelayAccess&);

  void add_to(transport::WaitSet&) const noexcept;
  /// When on_time() has something to do.
  [[nodiscard]] std::int64_t next_time_ns() const noexcept;
  void on_time(std::int64_t now_ns);
  /// The live session's lane was last heard then: after a silence its direct way is given up, and the relay is told
  /// where this end is now.
  void heard_at(transport::LaneKind, std::int64_t heard_ns, std::int64_t now_ns);

  /// The next datagram at either port. It may be for take().
  [[nodiscard]] std::optional<transport::Received> receive(std::span<std::byte> buffer) noexcept;
  /// True if it is a relay's message or a probe: it ended here. It may have come here or at a lane's socket.
  bool take(const transport::Received&, std::int64_t now_ns);
  /// From the port that was asked. False if that is none of these.
  bool answer(const transport::Received& question, std::span<const std::byte> datagram) noexcept;

  /// One line for a person where something changed since the last call; else empty.
  [[nodiscard]] std::string news(std::int64_t now_ns);

 private:
  static constexpr std::size_t kLanes = 2;
  struct Port {
    transport::UdpSocket socket;
    transport::RelayClient client;
  };
  explicit RelayedPorts(std::array<Port, kLanes> ports) : ports_(std::move(ports)) {}
  [[nodiscard]] Port* port_of(const transport::Received&) noexcept;

  std::array<Port, kLanes> ports_;  // by LaneKind
  bool takes_turns_ = false;
  std::string told_;
};

}  // namespace farfeel::slave_sim
