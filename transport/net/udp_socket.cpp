#include "transport/net/udp_socket.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>

#include "transport/net/socket_address.h"
#include "transport/net/wait_set.h"

namespace farfeel::transport {
namespace {

constexpr int kSocketBufferBytes = 4 << 20;  // asked for; the kernel gives at most net.core.rmem_max
constexpr int kReceiveAttempts = 8;  // so that a storm of errors and oversize datagrams does not hold the caller

tl::unexpected<Error> system_error(const std::string& tried, const std::string& advice = "") {
  std::string message = tried + ": " + std::strerror(errno) + ".";
  if (!advice.empty()) message += " " + advice;
  return tl::unexpected(Error{ErrorKind::kSocket, message});
}

std::string advice_for_bind(int error) {
  switch (error) {
    case EADDRINUSE:
      return "Another program has this port: end it, or choose another port (0 takes any that is free).";
    case EADDRNOTAVAIL:
      return "This machine has no such address: `ip address` lists what it has; 0.0.0.0 or [::] is all of them.";
    case EACCES:
      return "Ports below 1024 are the administrator's: choose a higher one.";
    case EAFNOSUPPORT:
      return "This machine has that family of addresses switched off: use the other.";
    default:
      return "";
  }
}

template <typename Value>
bool set_option(int descriptor, int level, int name, const Value& value) noexcept {
  return setsockopt(descriptor, level, name, &value, sizeof value) == 0;
}

template <typename Value>
Value read_control(const cmsghdr& c) noexcept {
  Value value{};
  std::memcpy(&value, CMSG_DATA(&c), sizeof value);
  return value;
}

std::int64_t ns_of(const timespec& t) noexcept {
  return t.tv_sec * 1'000'000'000 + t.tv_nsec;
}

// Room for all that a received datagram may bring: its stamp, its marking and where it was sent to, of both families.
constexpr std::size_t kControlBytes = CMSG_SPACE(sizeof(timespec)) + 2 * CMSG_SPACE(sizeof(int)) +
                                      CMSG_SPACE(sizeof(in_pktinfo)) + CMSG_SPACE(sizeof(in6_pktinfo));

}  // namespace

UdpSocket::UdpSocket(int descriptor, const Address& local)
    : descriptor_(descriptor), local_(local), clock_(read_clocks()) {}

UdpSocket::UdpSocket(UdpSocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      sends_ipv4_mapped_(other.sends_ipv4_mapped_),
      local_(other.local_),
      clock_(other.clock_),
      counters_(other.counters_) {}

UdpSocket& UdpSocket::operator=(UdpSocket&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(sends_ipv4_mapped_, other.sends_ipv4_mapped_);
  std::swap(local_, other.local_);
  std::swap(clock_, other.clock_);
  std::swap(counters_, other.counters_);
  return *this;
}

UdpSocket::~UdpSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

tl::expected<UdpSocket, Error> UdpSocket::open_unbound(const Address& like, const Options& options) {
  const int descriptor =
      socket(like.is_ipv6 ? AF_INET6 : AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_UDP);
  if (descriptor < 0) return system_error("cannot open a UDP socket for " + to_string(like), advice_for_bind(errno));
  UdpSocket result(descriptor, like);
  result.sends_ipv4_mapped_ = like.is_ipv6 && options.also_ipv4;
  const bool has_ipv4 = !like.is_ipv6 || options.also_ipv4;
  if (like.is_ipv6 && !set_option(descriptor, IPPROTO_IPV6, IPV6_V6ONLY, int{!options.also_ipv4}))
    return system_error("cannot choose the families of " + to_string(like));
  // In one piece or not at all: a fragment lost is all lost, and firewalls drop them. PROBE, unlike DO, does not
  // believe messages from the way about what fits there, which anybody can forge.
  if (has_ipv4 && !set_option(descriptor, IPPROTO_IP, IP_MTU_DISCOVER, int{IP_PMTUDISC_PROBE}))
    return system_error("cannot forbid fragments on " + to_string(like));
  if (like.is_ipv6 && !set_option(descriptor, IPPROTO_IPV6, IPV6_MTU_DISCOVER, int{IPV6_PMTUDISC_PROBE}))
    return system_error("cannot forbid fragments on " + to_string(like));
  // Best effort from here on: without them bursts overflow sooner, arrival times are those of reading, markings
  // unknown.
  (void)set_option(descriptor, SOL_SOCKET, SO_RCVBUF, kSocketBufferBytes);
  (void)set_option(descriptor, SOL_SOCKET, SO_SNDBUF, kSocketBufferBytes);
  (void)set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, int{1});
  if (has_ipv4) (void)set_option(descriptor, IPPROTO_IP, IP_RECVTOS, int{1});
  if (like.is_ipv6) (void)set_option(descriptor, IPPROTO_IPV6, IPV6_RECVTCLASS, int{1});
  (void)result.set_marking(options.dscp, options.ecn);
  return result;
}

tl::expected<UdpSocket, Error> UdpSocket::open(const Address& wanted, const Options& options) {
  auto result = open_unbound(wanted, options);
  if (!result) return result;
  const int descriptor = result->descriptor_;
  // A socket on every address must be told which one each datagram was sent to.
  if (wanted.is_any() && !(wanted.is_ipv6 ? set_option(descriptor, IPPROTO_IPV6, IPV6_RECVPKTINFO, int{1})
                                          : set_option(descriptor, IPPROTO_IP, IP_PKTINFO, int{1})))
    return system_error("cannot learn where datagrams to " + to_string(wanted) + " were sent to");
  if (options.port_use == Options::Port::kJoins && !set_option(descriptor, SOL_SOCKET, SO_REUSEPORT, int{1}))
    return system_error("cannot share the port of " + to_string(wanted));
  sockaddr_storage address;
  const socklen_t size = to_sockaddr(wanted, address);
  if (bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) != 0)
    return system_error("cannot listen on " + to_string(wanted), advice_for_bind(errno));
  // Only now: a socket that offers to share when it binds would also join a port that somebody else founded.
  if (options.port_use == Options::Port::kFounds && !set_option(descriptor, SOL_SOCKET, SO_REUSEPORT, int{1}))
    return system_error("cannot share the port of " + to_string(wanted));
  if (auto learnt = result->learn_local(); !learnt) return tl::unexpected(learnt.error());
  return result;
}

tl::expected<UdpSocket, Error> UdpSocket::open_towards(const Address& peer, const Options& options) {
  auto result = open_unbound(peer, options);
  if (!result) return result;
  result->local_ = any_address(peer.is_ipv6);
  if (auto connected = result->connect(peer); !connected) return tl::unexpected(connected.error());
  return result;
}

tl::expected<void, Error> UdpSocket::learn_local() {
  sockaddr_storage address;
  socklen_t size = sizeof address;
  if (getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    return system_error("cannot learn the port of " + to_string(local_));
  local_ = from_sockaddr(address);
  return {};
}

tl::expected<void, Error> UdpSocket::connect(const Address& peer) {
  sockaddr_storage address;
  const socklen_t size = to_sockaddr(peer, address, sends_ipv4_mapped_);
  if (::connect(descriptor_, reinterpret_cast<sockaddr*>(&address), size) != 0)
    return system_error("cannot reach " + to_string(peer) + " from " + to_string(local_),
                        errno == ENETUNREACH || errno == EADDRNOTAVAIL
                            ? "This machine has no way there: check its network, or use the other family of addresses."
                            : "");
  return learn_local();
}

bool UdpSocket::follow_local_address(const Address& peer) noexcept {
  sockaddr_storage there;
  const socklen_t there_size = to_sockaddr(peer, there, sends_ipv4_mapped_);
  const auto local_of = [](int descriptor) -> std::optional<Address> {
    sockaddr_storage local;
    socklen_t size = sizeof local;
    if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&local), &size) != 0) return std::nullopt;
    return from_sockaddr(local).with_port(0);
  };
  // A socket that never sends learns which address the system would choose now.
  const int scout = socket(there.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, IPPROTO_UDP);
  if (scout < 0) return false;
  const bool has_way = ::connect(scout, reinterpret_cast<sockaddr*>(&there), there_size) == 0;
  const auto chosen = local_of(scout), own = local_of(descriptor_);
  ::close(scout);
  if (!has_way || !chosen || !own || *chosen == *own) return false;
  sockaddr nobody{};
  nobody.sa_family = AF_UNSPEC;
  (void)::connect(descriptor_, &nobody, sizeof nobody);  // lets the former address go
  return ::connect(descriptor_, reinterpret_cast<sockaddr*>(&there), there_size) == 0;
}

// A pending error, which an ICMP message left, is told once by the next call, and that call then does nothing else. So
// a send that fails is tried once more, or else anybody who forges ICMP could suppress datagrams.
bool UdpSocket::count_send(bool was_sent) noexcept {
  if (was_sent) return true;
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS) {
    ++counters_.unsent_full;
  } else if (errno == EMSGSIZE) {
    ++counters_.unsent_too_long;
  } else {
    ++counters_.unsent_refused;
  }
  return false;
}

namespace {

bool is_pending_error() noexcept {
  return errno == ECONNREFUSED || errno == EHOSTUNREACH || errno == ENETUNREACH || errno == EMSGSIZE || errno == EPROTO;
}

}  // namespace

bool UdpSocket::send(std::span<const std::byte> datagram) noexcept {
  const auto try_once = [&] { return ::send(descriptor_, datagram.data(), datagram.size(), MSG_NOSIGNAL) >= 0; };
  bool was_sent = try_once();
  if (!was_sent && is_pending_error()) {
    if (errno != EMSGSIZE) ++counters_.unreachable;
    was_sent = try_once();
  }
  return count_send(was_sent);
}

bool UdpSocket::send_to(const Address& to, std::span<const std::byte> datagram) noexcept {
  return send_from(Address{}, to, datagram);
}

std::size_t UdpSocket::send_burst(std::span<const std::span<const std::byte>> datagrams) noexcept {
  std::array<iovec, kMostBurst> parts;
  std::array<mmsghdr, kMostBurst> messages;
  const std::size_t size = std::min(datagrams.size(), kMostBurst);
  for (std::size_t i = 0; i < size; ++i) {
    parts[i] = {const_cast<std::byte*>(datagrams[i].data()), datagrams[i].size()};  // sendmmsg only reads it
    messages[i] = {};
    messages[i].msg_hdr.msg_iov = &parts[i];
    messages[i].msg_hdr.msg_iovlen = 1;
  }
  std::size_t sent = 0;
  bool has_tried_again = false;
  while (sent < size) {
    const int taken = sendmmsg(descriptor_, messages.data() + sent, static_cast<unsigned>(size - sent), MSG_NOSIGNAL);
    if (taken > 0) {
      sent += static_cast<std::size_t>(taken);
      continue;
    }
    if (!is_pending_error() || has_tried_again) {
      (void)count_send(false);
      break;
    }
    if (errno != EMSGSIZE) ++counters_.unreachable;
    has_tried_again = true;
  }
  return sent;
}

bool UdpSocket::send_from(const Address& local, const Address& to, std::span<const std::byte> datagram,
                          std::optional<Marking> marking) noexcept {
  sockaddr_storage address;
  iovec part{const_cast<std::byte*>(datagram.data()), datagram.size()};  // sendmsg only reads it
  alignas(cmsghdr) std::array<char, kControlBytes> control{};
  msghdr message{};
  message.msg_namelen = to_sockaddr(to, address, sends_ipv4_mapped_);
  message.msg_name = &address;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  const auto add_control = [&](int level, int type, const auto& value) {
    cmsghdr c{CMSG_LEN(sizeof value), level, type};
    std::memcpy(control.data() + message.msg_controllen, &c, sizeof c);
    std::memcpy(control.data() + message.msg_controllen + CMSG_LEN(0), &value, sizeof value);
    message.msg_controllen += CMSG_SPACE(sizeof value);
    message.msg_control = control.data();
  };
  if (!local.is_any() && local_.is_any()) {
    sockaddr_storage source;
    (void)to_sockaddr(local, source, sends_ipv4_mapped_);
    if (source.ss_family == AF_INET6) {
      sockaddr_in6 in6;
      std::memcpy(&in6, &source, sizeof in6);
      add_control(IPPROTO_IPV6, IPV6_PKTINFO, in6_pktinfo{in6.sin6_addr, local.scope_id});
    } else {
      sockaddr_in in4;
      std::memcpy(&in4, &source, sizeof in4);
      add_control(IPPROTO_IP, IP_PKTINFO, in_pktinfo{0, in4.sin_addr, {}});
    }
  }
  if (marking) {
    const int value = (marking->dscp & 63) << 2 | static_cast<int>(marking->ecn);
    if (to.is_ipv6) {
      add_control(IPPROTO_IPV6, IPV6_TCLASS, value);
    } else {
      add_control(IPPROTO_IP, IP_TOS, value);
    }
  }
  const auto try_once = [&] { return ::sendmsg(descriptor_, &message, MSG_NOSIGNAL) >= 0; };
  bool was_sent = try_once();
  if (!was_sent && is_pending_error()) was_sent = try_once();
  return count_send(was_sent);
}

std::optional<Received> UdpSocket::receive(std::span<std::byte> buffer) noexcept {
  const std::int64_t before_ns = monotonic_ns();
  for (int attempt = 0; attempt < kReceiveAttempts; ++attempt) {
    sockaddr_storage from{};
    iovec part{buffer.data(), buffer.size()};
    alignas(cmsghdr) std::array<char, kControlBytes> control;
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(descriptor_, &message, MSG_DONTWAIT);
    if (size < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) {
        clock_.note_empty(before_ns);
        return std::nullopt;
      }
      // Somebody on the way answered with ICMP, which comes back here in place of a datagram.
      if (errno != EINTR) ++counters_.unreachable;
      continue;
    }
    if ((message.msg_flags & MSG_TRUNC) != 0) {
      ++counters_.skipped_too_long;
      continue;
    }

    Received received;
    received.bytes = buffer.first(static_cast<std::size_t>(size));
    received.from = from_sockaddr(from);
    received.to = local_;
    const ClockReading now = read_clocks();
    ArrivalClock::Arrival arrival{now.monotonic_ns, false};
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
      int marking = -1;
      if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SCM_TIMESTAMPNS) {
        arrival = clock_.arrival(ns_of(read_control<timespec>(*c)), now);
      } else if (c->cmsg_level == IPPROTO_IP && c->cmsg_type == IP_TOS) {
        marking = read_control<std::uint8_t>(*c);
      } else if (c->cmsg_level == IPPROTO_IPV6 && c->cmsg_type == IPV6_TCLASS) {
        marking = read_control<int>(*c);
      } else if (c->cmsg_level == IPPROTO_IP && c->cmsg_type == IP_PKTINFO) {
        sockaddr_in to{};
        to.sin_addr = read_control<in_pktinfo>(*c).ipi_spec_dst;
        std::memcpy(received.to.ip.data(), &to.sin_addr, 4);
      } else if (c->cmsg_level == IPPROTO_IPV6 && c->cmsg_type == IPV6_PKTINFO) {
        const auto info = read_control<in6_pktinfo>(*c);
        received.to = from_ipv6(info.ipi6_addr.s6_addr, local_.port, info.ipi6_ifindex);
      }
      if (marking >= 0) {
        received.has_marking = true;
        received.dscp = static_cast<std::uint8_t>(marking >> 2 & 63);
        received.ecn = static_cast<Ecn>(marking & 3);
      }
    }
    received.time_ns = arrival.time_ns;
    received.time_is_of_arrival = arrival.is_known;
    if (!arrival.is_known) ++counters_.untrusted_times;
    return received;
  }
  return std::nullopt;
}

bool UdpSocket::wait_until(std::int64_t until_ns) noexcept {
  WaitSet set;
  set.add(descriptor_);
  return set.wait_until(until_ns);
}

bool UdpSocket::set_marking(Dscp dscp, Ecn ecn) noexcept {
  const int value = static_cast<int>(dscp) << 2 | static_cast<int>(ecn);
  bool is_set = true;
  if (local_.is_ipv6) is_set = set_option(descriptor_, IPPROTO_IPV6, IPV6_TCLASS, value);
  if (!local_.is_ipv6 || sends_ipv4_mapped_) is_set = set_option(descriptor_, IPPROTO_IP, IP_TOS, value) && is_set;
  return is_set;
}

}  // namespace farfeel::transport
