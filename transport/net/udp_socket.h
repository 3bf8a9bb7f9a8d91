// A non-blocking UDP socket: who sent what, to which of our addresses, when, and how the network marked it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/net/address.h"
#include "transport/net/arrival_clock.h"
#include "transport/net/datagram.h"

namespace farfeel::transport {

/// What went wrong on a socket so far. Nothing of it is retried here: state goes stale.
struct SocketCounters {
  std::uint64_t unsent_full = 0;       ///< the kernel's buffer had no room
  std::uint64_t unsent_too_long = 0;   ///< longer than the interface carries in one piece; nothing is ever fragmented
  std::uint64_t unsent_refused = 0;    ///< no route, no permission (a firewall here), or another error
  std::uint64_t unreachable = 0;       ///< a host or a router on the way answered that nobody listens there
  std::uint64_t skipped_too_long = 0;  ///< received, but longer than the caller's buffer
  std::uint64_t untrusted_times = 0;   ///< arrivals that were given the time of reading instead
};

/// A bound UDP socket. Movable, closes itself. One thread uses it. After open or connect no call but connect allocates,
/// blocks or throws: realtime-safe.
class UdpSocket {
 public:
  struct Options {
    Dscp dscp = Dscp::kBestEffort;
    Ecn ecn = Ecn::kNotCapable;  ///< on what is sent; kCapable0 where somebody slows down when marks come back
    bool also_ipv4 = false;      ///< on [::]: IPv4 as well
    enum class Port : std::uint8_t {
      kAlone,   ///< fails if any other socket has the port
      kFounds,  ///< the same, and sockets that join may have it afterwards
      kJoins,   ///< beside one that founds, of the same user
    } port_use = Port::kAlone;
  };

  /// Port 0 takes a free one. Fails (kSocket) where the address is not this machine's or the port is taken.
  [[nodiscard]] static tl::expected<UdpSocket, Error> open(const Address& local, const Options&);
  [[nodiscard]] static tl::expected<UdpSocket, Error> open(const Address& local) { return open(local, {}); }
  /// A socket on a free port of whichever local address the system reaches peer from, connected to peer. The local
  /// address stays: a machine that changes networks opens another.
  [[nodiscard]] static tl::expected<UdpSocket, Error> open_towards(const Address& peer, const Options&);

  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;
  ~UdpSocket();

  /// From now on the kernel drops what others send, and send() goes to peer. May be called again for another peer. What
  /// waited before the call is still received: whoever cares compares Received::from. The kernel's part takes some
  /// microseconds and does not block, so a real-time thread may call it now and then; only a failure allocates.
  [[nodiscard]] tl::expected<void, Error> connect(const Address& peer);

  /// Of a socket of open_towards(peer): where the system would by now reach peer from another local address (a cable
  /// was plugged, a network changed), takes that one, and another port. Whether it did. Some microseconds; any thread
  /// may call it while another sends and receives. local() stays what it was.
  bool follow_local_address(const Address& peer) noexcept;

  /// False if the kernel took nothing; counters() say why.
  bool send(std::span<const std::byte> datagram) noexcept;
  /// Many in one system call, in order. How many the kernel took; the rest was not sent. At most kMostBurst at once.
  std::size_t send_burst(std::span<const std::span<const std::byte>> datagrams) noexcept;
  static constexpr std::size_t kMostBurst = 64;
  bool send_to(const Address& to, std::span<const std::byte> datagram) noexcept;
  /// From this local address (its port is ignored), as an answer must be: from where the question went, Received::to.
  /// 0.0.0.0 or :: leaves the choice to the system. With a marking, this one datagram bears that in place of the
  /// socket's.
  struct Marking {
    std::uint8_t dscp = 0;
    Ecn ecn = Ecn::kNotCapable;
  };
  bool send_from(const Address& local, const Address& to, std::span<const std::byte> datagram,
                 std::optional<Marking> marking = {}) noexcept;

  /// The next waiting datagram, or nothing. Longer ones than the buffer are skipped and counted.
  [[nodiscard]] std::optional<Received> receive(std::span<std::byte> buffer) noexcept;
  /// Waits until something can be received or until_ns is past (CLOCK_MONOTONIC). For threads with nothing else to do;
  /// several sockets at once: wait_set.h.
  bool wait_until(std::int64_t until_ns) noexcept;

  /// On what is sent from now on. False if the kernel refuses.
  bool set_marking(Dscp, Ecn) noexcept;

  [[nodiscard]] const Address& local() const noexcept { return local_; }
  [[nodiscard]] const SocketCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  UdpSocket(int descriptor, const Address& local);
  [[nodiscard]] static tl::expected<UdpSocket, Error> open_unbound(const Address& like, const Options&);
  [[nodiscard]] tl::expected<void, Error> learn_local();
  bool count_send(bool was_sent) noexcept;
  int descriptor_ = -1;
  bool sends_ipv4_mapped_ = false;  // an IPv6 socket that also serves IPv4
  Address local_;
  ArrivalClock clock_;
  SocketCounters counters_;
};

}  // namespace farfeel::transport
