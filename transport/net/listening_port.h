// The slave's one UDP port.
//
//   strangers, handshakes ──▶ ListeningPort   io thread; unconnected
//                               │      ▲
//                       pass_on │      │ strays
//                               ▼      │
//   the lane's peer ────────▶ LaneSocket      the lane's thread; connected to its peer, so that the kernel keeps all
//                                             others away from it
//
// All sockets are bound to the same port. The kernel gives a datagram to the socket that is connected to its sender,
// and otherwise to the listener. Three things keep that from being quite so simple:
//  - A lane's socket takes strangers' datagrams between its bind and its connect. It compares each source with its
//    peer's and gives back what is not its own: a stray.
//  - A peer whose address changed is a stranger again. The listener cannot open its datagrams and must not move the
//    lane's window: it passes them on raw, and the lane, once it has opened one, connects to where it came from.
//  - Whoever may join the port could read along. Only sockets of the same user may: drop privileges before open().
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "transport/error.h"
#include "transport/net/address.h"
#include "transport/net/datagram.h"
#include "transport/net/lane_socket.h"
#include "transport/net/udp_socket.h"
#include "transport/net/wait_set.h"

namespace farfeel::transport {

/// One thread uses it, the io thread. After open() only make_lane allocates.
class ListeningPort {
 public:
  struct Options {
    bool also_ipv4 = false;  ///< where local is [::]: IPv4 as well
    Dscp dscp = Dscp::kExpedited;
  };
  /// Fails if any other socket has the port: two slaves on one port would share the datagrams at random.
  [[nodiscard]] static tl::expected<ListeningPort, Error> open(const Address& local, const Options&);

  /// A lane's socket, not connected yet. It may move to its thread, and it may outlive the port: strays are lost then.
  /// At most kMostLanes at once; a lane
  /// that was destroyed makes room, and strays of it that were not read yet are lost then.
  [[nodiscard]] tl::expected<LaneSocket, Error> make_lane(Dscp, Ecn = Ecn::kNotCapable);
  static constexpr std::size_t kMostLanes = 14;

  /// The next datagram of somebody to whom no lane is connected, or a lane's stray, or nothing.
  [[nodiscard]] std::optional<Received> receive(std::span<std::byte> buffer) noexcept;
  /// Answers from the address that was asked. False if the kernel took nothing.
  bool answer(const Received& question, std::span<const std::byte> datagram) noexcept;
  /// To anybody, from whichever address the system takes.
  bool send_to(const Address& to, std::span<const std::byte> datagram) noexcept {
    return socket_.send_to(to, datagram);
  }
  /// Gives a raw datagram to the lane (LaneSocket::number) and wakes it. False if the lane is gone, or has no room:
  /// counted as dropped there.
  bool pass_on(std::uint32_t lane, const Received&) noexcept;

  /// What to sleep on for new datagrams and strays.
  void add_to(WaitSet&) const noexcept;
  bool wait_until(std::int64_t until_ns) const noexcept;

  [[nodiscard]] const Address& local() const noexcept { return socket_.local(); }
  [[nodiscard]] const SocketCounters& counters() const noexcept { return socket_.counters(); }

 private:
  ListeningPort(UdpSocket, const Options&, std::shared_ptr<WakeEvent>);
  std::optional<Received> receive_stray(std::span<std::byte> buffer) noexcept;
  UdpSocket socket_;
  Options options_;
  std::shared_ptr<WakeEvent> wake_;               // lanes signal it when they leave a stray
  std::vector<std::shared_ptr<LanePost>> posts_;  // one a lane; its place is the lane's number
  RawDatagram stray_;
  bool strays_first_ = false;
};

}  // namespace farfeel::transport
