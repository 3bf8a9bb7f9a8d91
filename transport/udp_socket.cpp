#include "transport/udp_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <utility>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr int kSocketBufferBytes = 4 << 20;             // asked for; the kernel gives at most net.core.rmem_max
constexpr std::int64_t kMaxStampAge_ns = kNsPerSecond;  // an older stamp means that the wall clock was stepped

tl::unexpected<Error> system_error(const std::string& tried, const std::string& advice = "") {
  std::string message = tried + ": " + std::strerror(errno) + ".";
  if (!advice.empty()) message += " " + advice;
  return tl::unexpected(Error{ErrorKind::kSocket, message});
}

Error refusal_of(const std::string& address) {
  return {ErrorKind::kRefused,
          "refused to use address " + address +
              ": datagrams are not encrypted or authenticated yet, so anybody on that network could move the tool. Use "
              "127.0.0.1 or [::1]; to cross machines, tunnel UDP through something that authenticates, such as "
              "WireGuard, and end the tunnel in a local relay."};
}

std::int64_t ns_of(const timespec& t) {
  return t.tv_sec * kNsPerSecond + t.tv_nsec;
}

std::int64_t now_ns(clockid_t clock) noexcept {
  timespec t{};
  clock_gettime(clock, &t);
  return ns_of(t);
}

socklen_t to_sockaddr(const Address& address, sockaddr_storage& out) noexcept {
  out = {};
  if (address.is_ipv6) {
    sockaddr_in6 in6{};
    in6.sin6_family = AF_INET6;
    in6.sin6_port = htons(address.port);
    std::memcpy(&in6.sin6_addr, address.ip.data(), 16);
    std::memcpy(&out, &in6, sizeof in6);
    return sizeof in6;
  }
  sockaddr_in in4{};
  in4.sin_family = AF_INET;
  in4.sin_port = htons(address.port);
  std::memcpy(&in4.sin_addr, address.ip.data(), 4);
  std::memcpy(&out, &in4, sizeof in4);
  return sizeof in4;
}

Address from_sockaddr(const sockaddr_storage& from) noexcept {
  Address address;
  if (from.ss_family == AF_INET6) {
    sockaddr_in6 in6{};
    std::memcpy(&in6, &from, sizeof in6);
    address.is_ipv6 = true;
    std::memcpy(address.ip.data(), &in6.sin6_addr, 16);
    address.port = ntohs(in6.sin6_port);
  } else {
    sockaddr_in in4{};
    std::memcpy(&in4, &from, sizeof in4);
    std::memcpy(address.ip.data(), &in4.sin_addr, 4);
    address.port = ntohs(in4.sin_port);
  }
  return address;
}

std::optional<std::uint16_t> port_of(const std::string& text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return port;
}

// Arrival on the monotonic clock: the kernel stamps with the wall clock, so its age is taken there.
std::int64_t arrival_ns(msghdr& message) noexcept {
  const std::int64_t now = monotonic_ns();
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    const std::int64_t age = now_ns(CLOCK_REALTIME) - ns_of(stamp);
    return age >= 0 && age < kMaxStampAge_ns ? now - age : now;
  }
  return now;
}

}  // namespace

Address Address::with_port(std::uint16_t other) const {
  Address copy = *this;
  copy.port = other;
  return copy;
}

bool Address::is_loopback() const {
  return is_ipv6 ? ip == loopback(true).ip : ip[0] == 127;
}

std::string to_string(const Address& address) {
  char text[INET6_ADDRSTRLEN] = "";
  inet_ntop(address.is_ipv6 ? AF_INET6 : AF_INET, address.ip.data(), text, sizeof text);
  const std::string port = std::to_string(address.port);
  return address.is_ipv6 ? "[" + std::string(text) + "]:" + port : std::string(text) + ":" + port;
}

tl::expected<Address, Error> loopback_address(const std::string& text, std::optional<std::uint16_t> default_port) {
  const auto unreadable = [&](const std::string& why) {
    return tl::unexpected(Error{ErrorKind::kAddress, "cannot read address '" + text + "': " + why +
                                                         ". Write 127.0.0.1:4000, [::1]:4000 or localhost:4000."});
  };
  std::string host = text, port_text;
  if (!text.empty() && text.front() == '[') {
    const auto close = text.find(']');
    if (close == std::string::npos) return unreadable("the bracket is not closed");
    host = text.substr(1, close - 1);
    if (close + 1 < text.size()) {
      if (text[close + 1] != ':') return unreadable("expected ':' after the bracket");
      port_text = text.substr(close + 2);
      if (port_text.empty()) return unreadable("there is no port after ':'");
    }
  } else if (const auto colon = text.rfind(':'); colon != std::string::npos && text.find(':') == colon) {
    host = text.substr(0, colon);
    port_text = text.substr(colon + 1);
    if (port_text.empty()) return unreadable("there is no port after ':'");
  }
  if (host == "localhost") host = "127.0.0.1";

  Address address;
  if (inet_pton(AF_INET, host.c_str(), address.ip.data()) == 1) {
    address.is_ipv6 = false;
  } else if (inet_pton(AF_INET6, host.c_str(), address.ip.data()) == 1) {
    address.is_ipv6 = true;
  } else {
    return unreadable("'" + host + "' is not a numeric IPv4 or IPv6 address");
  }
  if (port_text.empty()) {
    if (!default_port) return unreadable("there is no port");
    address.port = *default_port;
  } else if (const auto port = port_of(port_text)) {
    address.port = *port;
  } else {
    return unreadable("'" + port_text + "' is not a port (0 to 65535)");
  }
  if (!address.is_loopback()) return tl::unexpected(refusal_of(text));
  return address;
}

Error not_loopback(const Address& address) {
  return refusal_of(to_string(address));
}

Address loopback(bool is_ipv6) {
  Address address;
  address.is_ipv6 = is_ipv6;
  if (is_ipv6) {
    address.ip[15] = 1;
  } else {
    address.ip[0] = 127;
    address.ip[3] = 1;
  }
  return address;
}

std::int64_t monotonic_ns() noexcept {
  return now_ns(CLOCK_MONOTONIC);
}

tl::expected<UdpSocket, Error> UdpSocket::open(const Address& wanted) {
  if (!wanted.is_loopback()) return tl::unexpected(not_loopback(wanted));
  const int descriptor =
      socket(wanted.is_ipv6 ? AF_INET6 : AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_UDP);
  if (descriptor < 0) return system_error("cannot open a UDP socket for " + to_string(wanted));
  UdpSocket result(descriptor, wanted);
  sockaddr_storage address;
  socklen_t size = to_sockaddr(wanted, address);
  if (bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) != 0)
    return system_error("cannot listen on " + to_string(wanted),
                        errno == EADDRINUSE ? "Another program has this port: end it, or choose another --port." : "");
  const int on = 1, bytes = kSocketBufferBytes;
  // Best effort: without them arrival times are those of the receiving call, and bursts overflow sooner.
  (void)setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  (void)setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  (void)setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
  size = sizeof address;
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    return system_error("cannot learn the port of " + to_string(wanted));
  result.local_ = from_sockaddr(address);
  return result;
}

tl::expected<std::array<UdpSocket, 2>, Error> UdpSocket::open_pair(const Address& local) {
  constexpr int kTries = 64;  // a free port's neighbour may be taken
  for (int attempt = 0;; ++attempt) {
    auto first = open(local);
    if (!first) return tl::unexpected(first.error());
    const std::uint16_t port = first->local().port;
    if (port != 0xFFFF) {
      auto second = open(local.with_port(static_cast<std::uint16_t>(port + 1)));
      if (second) return std::array<UdpSocket, 2>{std::move(*first), std::move(*second)};
      if (local.port != 0 || attempt >= kTries) return tl::unexpected(second.error());
    } else if (local.port != 0) {
      return tl::unexpected(
          Error{ErrorKind::kAddress, "port 65535 has no neighbour for the bulk lane: choose a lower one."});
    }
  }
}

UdpSocket::UdpSocket(UdpSocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), local_(other.local_) {}

UdpSocket& UdpSocket::operator=(UdpSocket&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(local_, other.local_);
  return *this;
}

UdpSocket::~UdpSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

tl::expected<void, Error> UdpSocket::connect(const Address& peer) {
  if (!peer.is_loopback()) return tl::unexpected(not_loopback(peer));
  sockaddr_storage address;
  const socklen_t size = to_sockaddr(peer, address);
  if (::connect(descriptor_, reinterpret_cast<sockaddr*>(&address), size) != 0)
    return system_error("cannot reach " + to_string(peer) + " from " + to_string(local_));
  return {};
}

bool UdpSocket::send(std::span<const std::byte> datagram) noexcept {
  return ::send(descriptor_, datagram.data(), datagram.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(datagram.size());
}

bool UdpSocket::send_to(const Address& to, std::span<const std::byte> datagram) noexcept {
  sockaddr_storage address;
  const socklen_t size = to_sockaddr(to, address);
  return ::sendto(descriptor_, datagram.data(), datagram.size(), MSG_NOSIGNAL, reinterpret_cast<sockaddr*>(&address),
                  size) == static_cast<ssize_t>(datagram.size());
}

std::optional<Received> UdpSocket::receive(std::span<std::byte> buffer) noexcept {
  // A peer that is not there yet answers with ICMP, which comes back here as an error in place of a datagram. The
  // bound keeps a storm of those from holding the caller.
  for (int attempt = 0; attempt < 8; ++attempt) {
    sockaddr_storage from{};
    iovec part{buffer.data(), buffer.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control{};
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(descriptor_, &message, MSG_DONTWAIT);
    if (size < 0) {
      if (errno == ECONNREFUSED || errno == EINTR || errno == EHOSTUNREACH || errno == ENETUNREACH) continue;
      return std::nullopt;
    }
    if ((message.msg_flags & MSG_TRUNC) != 0) continue;
    return Received{buffer.first(static_cast<std::size_t>(size)), from_sockaddr(from), arrival_ns(message)};
  }
  return std::nullopt;
}

bool UdpSocket::wait_until(std::int64_t until_ns) noexcept {
  const std::int64_t left = until_ns - monotonic_ns();
  const timespec timeout{left > 0 ? left / kNsPerSecond : 0, left > 0 ? left % kNsPerSecond : 0};
  pollfd poll{descriptor_, POLLIN, 0};
  return ppoll(&poll, 1, &timeout, nullptr) > 0;
}

}  // namespace farfeel::transport
