#include "transport/net/lane_socket.h"

#include <algorithm>
#include <utility>

namespace farfeel::transport {
namespace {

constexpr int kMostGivenBack =
    8192;  // about what 4 MiB of socket buffer hold; what finds no room is counted as dropped

}  // namespace

LaneSocket::LaneSocket(std::shared_ptr<LanePost> post, std::uint16_t port, Dscp dscp, Ecn ecn)
    : post_(std::move(post)), port_(port), dscp_(dscp), ecn_(ecn) {}

LaneSocket::LaneSocket(LaneSocket&&) noexcept = default;

LaneSocket::~LaneSocket() {
  if (!post_) return;
  disconnect();
  post_->lane_is_gone.store(true, std::memory_order_release);
}

// A socket that is connected to another peer, at the same local address, needs no new one: connect() moves it at once
// from one peer to the next, and no moment comes when it takes strangers' datagrams.
tl::expected<void, Error> LaneSocket::connect_to(const Address& peer, const Address& local) {
  const Address own = local.port == 0 ? local.with_port(port_) : local;
  if (socket_ && socket_->local() == own) {
    if (auto connected = socket_->connect(peer); !connected) return connected;
  } else {
    auto fresh = UdpSocket::open(own, {.dscp = dscp_, .ecn = ecn_, .port_use = UdpSocket::Options::Port::kJoins});
    if (!fresh) return tl::unexpected(fresh.error());
    if (auto connected = fresh->connect(peer); !connected) {
      give_back_all(*fresh);
      return connected;
    }
    if (socket_) leave(std::move(*socket_));
    socket_ = std::move(*fresh);
  }
  if (peer_ && *peer_ != peer) former_peer_ = peer_;
  peer_ = peer;
  return {};
}

// Connected to itself a socket receives nothing more, for it sends nothing to itself; so it can be emptied, and closed
// without loss.
void LaneSocket::leave(UdpSocket socket) noexcept {
  (void)socket.connect(socket.local());
  if (leaving_) give_back_all(*leaving_);
  leaving_ = std::move(socket);
}

void LaneSocket::disconnect() noexcept {
  if (socket_) leave(std::move(*socket_));
  if (leaving_) give_back_all(*leaving_);
  socket_.reset();
  leaving_.reset();
  peer_.reset();
  former_peer_.reset();
}

void LaneSocket::give_back(const Received& received) noexcept {
  if (post_->to_listener.push(RawDatagram(received))) post_->wake_listener->signal();
}

void LaneSocket::give_back_all(UdpSocket& socket) noexcept {
  std::array<std::byte, kMostDatagramBytes> buffer;
  for (int i = 0; i < kMostGivenBack; ++i) {
    const auto received = socket.receive(buffer);
    if (!received) return;
    give_back(*received);
  }
}

std::optional<Received> LaneSocket::receive_own(UdpSocket& socket, std::span<std::byte> buffer,
                                                int& strays_left) noexcept {
  while (strays_left > 0) {
    auto received = socket.receive(buffer);
    if (!received || received->from == peer_ || received->from == former_peer_) return received;
    ++strays_;
    --strays_left;
    give_back(*received);
  }
  return std::nullopt;
}

std::optional<Received> LaneSocket::receive(std::span<std::byte> buffer) noexcept {
  int strays_left = kMostStrays;
  if (leaving_) {
    if (auto received = receive_own(*leaving_, buffer, strays_left)) return received;
    if (strays_left > 0) leaving_.reset();
  }
  if (socket_) {
    if (auto received = receive_own(*socket_, buffer, strays_left)) return received;
    if (strays_left > 0 && !leaving_) former_peer_.reset();
  }
  while (post_->to_lane.pop(passed_)) {
    if (passed_.size > buffer.size()) continue;
    Received received = passed_.received;
    std::copy_n(passed_.bytes.begin(), passed_.size, buffer.begin());
    received.bytes = buffer.first(passed_.size);
    return received;
  }
  return std::nullopt;
}

bool LaneSocket::send(std::span<const std::byte> datagram) noexcept {
  return socket_ && socket_->send(datagram);
}

std::size_t LaneSocket::send_burst(std::span<const std::span<const std::byte>> datagrams) noexcept {
  return socket_ ? socket_->send_burst(datagrams) : 0;
}

SocketCounters LaneSocket::counters() const noexcept {
  return socket_ ? socket_->counters() : SocketCounters{};
}

void LaneSocket::add_to(WaitSet& set) const noexcept {
  if (socket_) set.add(socket_->descriptor());
  if (leaving_) set.add(leaving_->descriptor());
  set.add(post_->wake_lane);
}

bool LaneSocket::wait_until(std::int64_t until_ns) const noexcept {
  WaitSet set;
  add_to(set);
  return set.wait_until(until_ns);
}

}  // namespace farfeel::transport
