// One lane's end of the slave's port: see listening_port.h for the picture.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tl/expected.hpp>

#include "haptic_core/realtime/spsc_queue.h"
#include "transport/error.h"
#include "transport/net/address.h"
#include "transport/net/datagram.h"
#include "transport/net/udp_socket.h"
#include "transport/net/wait_set.h"

namespace farfeel::transport {

/// What crosses between the listener's thread and one lane's. Bounded; what does not fit is dropped and counted.
struct LanePost {
  /// About 64 ms of a peer that sends at 1 kHz from a new address, or 1.3 kB x 64 of memory.
  static constexpr std::size_t kSlots = 64;
  LanePost(std::uint32_t lane_number, WakeEvent wake, std::shared_ptr<WakeEvent> wake_of_listener)
      : number(lane_number), wake_lane(std::move(wake)), wake_listener(std::move(wake_of_listener)) {}

  realtime::SpscQueue<RawDatagram> to_lane{kSlots};
  realtime::SpscQueue<RawDatagram> to_listener{kSlots};
  const std::uint32_t number;
  const WakeEvent wake_lane;
  const std::shared_ptr<const WakeEvent> wake_listener;
  std::atomic<bool> lane_is_gone{false};
};

/// Used by one thread, the lane's. Realtime-safe, but for wait_until; connect_to takes some 20 us, and allocates only
/// where it fails.
class LaneSocket {
 public:
  LaneSocket(LaneSocket&&) noexcept;
  LaneSocket& operator=(LaneSocket&&) = delete;
  ~LaneSocket();

  /// From now on the kernel gives peer's datagrams to this lane, and send() goes to peer, from `local`: Received::from
  /// and Received::to of a datagram that was opened, or any_address() for whichever the system takes. Its port may be
  /// that of another socket that founds one (UdpSocket::Options), whose unknown datagrams come here as well; 0: the
  /// listening port's. What waits from the former peer is still received. On failure everything is as it was before.
  [[nodiscard]] tl::expected<void, Error> connect_to(const Address& peer, const Address& local);
  /// From now on peer's datagrams are the listener's again. What waits is given back to it, some 1 us each.
  void disconnect() noexcept;
  [[nodiscard]] const std::optional<Address>& peer() const noexcept { return peer_; }
  /// Whether datagrams like this one come here, and are answered from where it went.
  [[nodiscard]] bool is_connected_to(const Address& peer, const Address& local) const noexcept {
    return peer_ == peer && socket_ && socket_->local() == local;
  }

  /// The next datagram: the peer's, or a raw one that the listener passed on, from anywhere. Nothing if none waits, or
  /// after kMostStrays strangers' in a row: the caller has other work too.
  [[nodiscard]] std::optional<Received> receive(std::span<std::byte> buffer) noexcept;
  static constexpr int kMostStrays = 32;

  /// For the listener: a datagram that is not this lane's to open, such as its peer's next handshake.
  void give_back(const Received&) noexcept;

  /// To the peer. False if there is none, or the kernel took nothing: counters() say why.
  bool send(std::span<const std::byte> datagram) noexcept;
  std::size_t send_burst(std::span<const std::span<const std::byte>> datagrams) noexcept;

  void add_to(WaitSet&) const noexcept;
  /// True if there may be something to receive; false once until_ns (CLOCK_MONOTONIC) is past.
  bool wait_until(std::int64_t until_ns) const noexcept;

  /// What ListeningPort::pass_on takes; the number of a lane that ended may be given to a later one.
  [[nodiscard]] std::uint32_t number() const noexcept { return post_->number; }
  [[nodiscard]] SocketCounters counters() const noexcept;  ///< zeros while there is no socket
  [[nodiscard]] std::uint64_t inbox_dropped() const noexcept { return post_->to_lane.dropped(); }
  [[nodiscard]] std::uint64_t strays() const noexcept { return strays_; }  ///< found here, of others
  [[nodiscard]] std::uint64_t strays_dropped() const noexcept { return post_->to_listener.dropped(); }

 private:
  friend class ListeningPort;
  LaneSocket(std::shared_ptr<LanePost> post, std::uint16_t port, Dscp dscp, Ecn ecn);
  std::optional<Received> receive_own(UdpSocket&, std::span<std::byte> buffer, int& strays_left) noexcept;
  void give_back_all(UdpSocket&) noexcept;
  void leave(UdpSocket) noexcept;

  std::shared_ptr<LanePost> post_;
  std::uint16_t port_;
  Dscp dscp_;
  Ecn ecn_;
  std::optional<Address> peer_, former_peer_;  // former_peer_ while its datagrams may wait
  std::optional<UdpSocket> socket_;
  std::optional<UdpSocket> leaving_;  // of the former local address, until it is empty
  RawDatagram passed_;
  std::uint64_t strays_ = 0;
};

}  // namespace farfeel::transport
