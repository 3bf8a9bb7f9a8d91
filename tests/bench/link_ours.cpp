#include <array>
#include <optional>
#include <utility>

#include "tests/bench/link_method.h"
#include "transport/lane/peer_path.h"
#include "transport/lane/sealed_lane.h"
#include "transport/net/lane_socket.h"
#include "transport/net/listening_port.h"
#include "transport/net/udp_socket.h"

namespace farfeel::bench {
namespace {

using transport::SealedLane;

constexpr std::uint8_t kType = 1;  // any: nobody reads it here

std::size_t copy(std::span<const std::byte> message, std::span<std::byte> to) {
  if (message.size() > to.size()) return 0;
  std::copy(message.begin(), message.end(), to.begin());
  return message.size();
}

// As master_station/session/haptic_lane does it.
class Master final : public LinkEnd {
 public:
  explicit Master(transport::UdpSocket socket) : socket_(std::move(socket)) {}
  bool send(std::span<const std::byte> message) override {
    std::array<std::byte, transport::kMaxDatagramBytes> datagram;
    const std::size_t size = lane.seal(kType, message, datagram, transport::monotonic_ns());
    return size > 0 && socket_.send(std::span(datagram).first(size));
  }
  std::size_t receive(std::span<std::byte> to) override {
    std::array<std::byte, transport::kMaxDatagramBytes> buffer;
    const auto received = socket_.receive(buffer);
    if (!received) return 0;
    const auto bytes = std::span(buffer).first(received->bytes.size());
    if (transport::receiver_index(bytes) == 0) return 0;
    const auto opened = lane.open(bytes, received->time_ns);
    return opened && opened->is_newest ? copy(opened->message, to) : 0;
  }
  void wait_until(std::int64_t until_ns) override { (void)socket_.wait_until(until_ns); }
  SealedLane lane{SealedLane::Role::kInitiator};

 private:
  transport::UdpSocket socket_;
};

// As slave_sim/session/contact_lane does it.
class Slave final : public LinkEnd {
 public:
  Slave(transport::ListeningPort port, transport::LaneSocket socket)
      : port_(std::move(port)), socket_(std::move(socket)) {}
  bool send(std::span<const std::byte> message) override {
    std::array<std::byte, transport::kMaxDatagramBytes> datagram;
    if (!path.may_send(message.size() + transport::kSealBytes)) return false;
    const std::size_t size = lane.seal(kType, message, datagram, transport::monotonic_ns());
    if (size == 0 || !socket_.send(std::span(datagram).first(size))) return false;
    path.on_sent(size);
    return true;
  }
  std::size_t receive(std::span<std::byte> to) override {
    std::array<std::byte, transport::kMaxDatagramBytes> buffer;
    const auto received = socket_.receive(buffer);
    if (!received) return 0;
    const auto bytes = std::span(buffer).first(received->bytes.size());
    if (transport::receiver_index(bytes) == 0) return 0;
    const auto opened = lane.open(bytes, received->time_ns);
    if (!opened) return 0;
    path.on_authentic(received->from, bytes.size(), opened->is_newest, opened->generation);
    if (path.address() == received->from && socket_.peer() != received->from)
      (void)socket_.connect_to(received->from, received->to);
    return opened->is_newest ? copy(opened->message, to) : 0;
  }
  void wait_until(std::int64_t until_ns) override { (void)socket_.wait_until(until_ns); }
  transport::LaneSocket& socket() { return socket_; }
  SealedLane lane{SealedLane::Role::kResponder};
  transport::PeerPath path;

 private:
  transport::ListeningPort port_;
  transport::LaneSocket socket_;
};

class Ours final : public LinkMethod {
 public:
  Ours(std::unique_ptr<Master> master, std::unique_ptr<Slave> slave, transport::Address master_address,
       transport::Suite suite)
      : master_(std::move(master)), slave_(std::move(slave)), master_address_(master_address), suite_(suite) {}
  LinkEnd& master() override { return *master_; }
  LinkEnd& slave() override { return *slave_; }
  /// A handshake's outcome: keys live for kKeyLife_ns, and the bench for longer.
  void begin_turn() override {
    transport::LaneKeys keys;
    keys.generation = ++generation_;
    keys.suite = suite_;
    keys.local_index = transport::new_local_index(transport::LaneKind::kHaptic);
    keys.remote_index = transport::new_local_index(transport::LaneKind::kHaptic);
    transport::fill_randomly(keys.send);
    transport::fill_randomly(keys.receive);
    keys.made_ns = transport::monotonic_ns();
    master_->lane.adopt(keys);
    std::swap(keys.local_index, keys.remote_index);
    std::swap(keys.send, keys.receive);
    slave_->lane.adopt(keys);
    slave_->path.on_handshake(master_address_, generation_);
  }

 private:
  std::unique_ptr<Master> master_;
  std::unique_ptr<Slave> slave_;
  transport::Address master_address_;
  transport::Suite suite_;
  std::uint64_t generation_ = 0;
};

}  // namespace

MadeMethod make_ours(const TwoEnds& ends, transport::Suite suite) {
  using transport::Dscp, transport::ListeningPort, transport::UdpSocket;
  if (!is_available(suite)) return tl::unexpected(std::string("this processor has no AES instructions"));
  std::string failed;
  std::optional<ListeningPort> port;
  std::optional<transport::LaneSocket> lane;
  ends.in(TwoEnds::End::kSlave, [&] {
    auto opened = ListeningPort::open(ends.address(TwoEnds::End::kSlave), {});
    if (!opened) return void(failed = opened.error().message);
    port.emplace(std::move(*opened));
    auto made = port->make_lane(Dscp::kExpedited);
    if (!made) return void(failed = made.error().message);
    lane.emplace(std::move(*made));
  });
  if (!failed.empty()) return tl::unexpected(failed);
  std::unique_ptr<Master> master;
  transport::Address master_address;
  ends.in(TwoEnds::End::kMaster, [&] {
    UdpSocket::Options options;
    options.dscp = Dscp::kExpedited;
    auto socket = UdpSocket::open_towards(port->local(), options);
    if (!socket) return void(failed = socket.error().message);
    master_address = socket->local();
    master = std::make_unique<Master>(std::move(*socket));
  });
  if (!failed.empty()) return tl::unexpected(failed);
  // LaneSocket opens its own socket when it connects: in the slave's namespace, as its first datagram would have it.
  const transport::Address slave_address = port->local();
  auto slave = std::make_unique<Slave>(std::move(*port), std::move(*lane));
  ends.in(TwoEnds::End::kSlave, [&] {
    const auto connected = slave->socket().connect_to(master_address, slave_address);
    if (!connected) failed = connected.error().message;
  });
  if (!failed.empty()) return tl::unexpected(failed);
  return std::make_unique<Ours>(std::move(master), std::move(slave), master_address, suite);
}

}  // namespace farfeel::bench
