// The master's lanes where they go over a relay: each registers its socket there, and leaves the relay for a direct way
// when one is proven.
//
// The sockets are not connected, for datagrams come from the relay and past it; what is sent goes to path(), which
// changes here and nowhere else. The slave's lanes follow. When a lane falls silent its path is the relay's again.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "transport/relay/relay_access.h"
#include "transport/seal/handshake_messages.h"

namespace farfeel::master_station {

/// No sockets, no clocks: time is an argument. One thread, the io thread.
class RelayedLanes {
 public:
  using SendTo =
      std::function<void(transport::LaneKind, const transport::Address& to, std::span<const std::byte> datagram)>;

  /// The bulk lane registers from now on; the haptic one while it is used.
  RelayedLanes(const transport::RelayAccess&, std::int64_t now_ns);
  /// Whether the haptic thread reads its socket; before that no answer would be read.
  void use_haptic(bool is_used, std::int64_t now_ns);

  /// True if it is a relay's message or a probe: it ended here.
  bool take(transport::LaneKind, const transport::Address& from, std::span<const std::byte> datagram,
            std::int64_t now_ns);
  /// When a lane last heard its slave; 0: never. After a silence its path is the relay's.
  void heard_at(transport::LaneKind, std::int64_t heard_ns, std::int64_t now_ns);
  void on_time(std::int64_t now_ns, const SendTo&);
  /// When on_time() has something to do.
  [[nodiscard]] std::int64_t next_time_ns() const noexcept;

  /// Whether what is sent to path() may arrive. Stays true once it was, while the lane is used.
  [[nodiscard]] bool is_open(transport::LaneKind, std::int64_t now_ns);
  [[nodiscard]] transport::Address path(transport::LaneKind) const noexcept;
  [[nodiscard]] bool is_direct(transport::LaneKind) const noexcept;
  /// Why the slave cannot be greeted over the relay, for a person; empty if it can.
  [[nodiscard]] std::string trouble(std::int64_t now_ns) const;

 private:
  struct Lane {
    transport::RelayClient client;
    std::int64_t since_ns = 0;  // of a silence, at the earliest
    bool was_open = false;
  };
  void start(transport::LaneKind, std::int64_t now_ns);

  transport::RelayAccess access_;
  std::array<std::optional<Lane>, 2> lanes_;  // by LaneKind
};

}  // namespace farfeel::master_station
