// ENet 1.3: one channel, unreliable sequenced packets. Its throttle would drop such packets silently where round trips
// vary; with a deceleration of 0 it never does. It seals nothing.
#include <enet/enet.h>

#include <algorithm>

#include "tests/bench/connected_sockets.h"
#include "tests/bench/link_method.h"

namespace farfeel::bench {
namespace {

constexpr int kConnect_ms = 2000;

class EnetEnd final : public LinkEnd {
 public:
  ~EnetEnd() override {
    if (host != nullptr) enet_host_destroy(host);
  }
  bool send(std::span<const std::byte> message) override {
    ENetPacket* packet = enet_packet_create(message.data(), message.size(), 0);
    if (packet == nullptr) return false;
    if (enet_peer_send(peer, 0, packet) != 0) {
      enet_packet_destroy(packet);
      return false;
    }
    enet_host_flush(host);
    return true;
  }
  std::size_t receive(std::span<std::byte> to) override {
    ENetEvent event;
    if (enet_host_service(host, &event, 0) <= 0 || event.type != ENET_EVENT_TYPE_RECEIVE) return 0;
    const std::size_t size = std::min<std::size_t>(event.packet->dataLength, to.size());
    std::copy_n(reinterpret_cast<const std::byte*>(event.packet->data), size, to.begin());
    enet_packet_destroy(event.packet);
    return size;
  }
  void wait_until(std::int64_t until_ns) override { wait_readable(host->socket, until_ns); }
  /// Whether the other end's hello or its answer was here.
  bool connects() {
    ENetEvent event;
    if (enet_host_service(host, &event, 1) <= 0 || event.type != ENET_EVENT_TYPE_CONNECT) return false;
    peer = event.peer;
    enet_peer_throttle_configure(peer, ENET_PEER_PACKET_THROTTLE_INTERVAL, ENET_PEER_PACKET_THROTTLE_SCALE, 0);
    return true;
  }
  ENetHost* host = nullptr;
  ENetPeer* peer = nullptr;
};

class Enet final : public LinkMethod {
 public:
  Enet(std::unique_ptr<EnetEnd> master, std::unique_ptr<EnetEnd> slave)
      : master_(std::move(master)), slave_(std::move(slave)) {}
  LinkEnd& master() override { return *master_; }
  LinkEnd& slave() override { return *slave_; }

 private:
  std::unique_ptr<EnetEnd> master_, slave_;
};

}  // namespace

MadeMethod make_enet(const TwoEnds& ends) {
  static const bool is_ready = enet_initialize() == 0;
  if (!is_ready) return tl::unexpected(std::string("ENet does not start"));
  auto master = std::make_unique<EnetEnd>(), slave = std::make_unique<EnetEnd>();
  const std::string text = to_string(ends.address(TwoEnds::End::kSlave));
  ENetAddress address{};
  enet_address_set_host_ip(&address, text.substr(0, text.rfind(':')).c_str());
  ends.in(TwoEnds::End::kSlave, [&] { slave->host = enet_host_create(&address, 1, 1, 0, 0); });
  ends.in(TwoEnds::End::kMaster, [&] { master->host = enet_host_create(nullptr, 1, 1, 0, 0); });
  if (master->host == nullptr || slave->host == nullptr) return tl::unexpected(std::string("ENet opens no socket"));
  address.port = slave->host->address.port;
  if (enet_host_connect(master->host, &address, 1, 0) == nullptr)
    return tl::unexpected(std::string("ENet does not connect"));
  for (int waited_ms = 0; waited_ms < kConnect_ms && (master->peer == nullptr || slave->peer == nullptr); ++waited_ms) {
    (void)(slave->connects() || master->connects());
  }
  if (master->peer == nullptr || slave->peer == nullptr) return tl::unexpected(std::string("ENet does not connect"));
  return std::make_unique<Enet>(std::move(master), std::move(slave));
}

}  // namespace farfeel::bench
