#include "slave_sim/session/relayed_ports.h"

#include <algorithm>

namespace farfeel::slave_sim {
namespace {

/// A master's lane sends at least each 20 ms while it lives.
constexpr std::int64_t kSilence_ns = 250'000'000;

}  // namespace

tl::expected<RelayedPorts, transport::Error> RelayedPorts::open(const transport::RelayAccess& access) {
  using transport::LaneKind;
  const auto open_one = [&](LaneKind lane, transport::Dscp dscp) -> tl::expected<Port, transport::Error> {
    auto socket = transport::UdpSocket::open(
        transport::any_address(access.relay.is_ipv6),
        {.dscp = dscp, .port_use = transport::UdpSocket::Options::Port::kFounds});  // the lane's socket joins
    if (!socket) return tl::unexpected(socket.error());
    return Port{std::move(*socket),
                transport::RelayClient(access.options(transport::RelayRole::kSlave, static_cast<std::uint8_t>(lane)),
                                       transport::monotonic_ns())};
  };
  auto haptic = open_one(LaneKind::kHaptic, transport::Dscp::kExpedited);
  if (!haptic) return tl::unexpected(haptic.error());
  auto bulk = open_one(LaneKind::kBulk, transport::Dscp::kBestEffort);
  if (!bulk) return tl::unexpected(bulk.error());
  static_assert(static_cast<int>(LaneKind::kHaptic) == 0 && static_cast<int>(LaneKind::kBulk) == 1);
  return RelayedPorts({std::move(*haptic), std::move(*bulk)});
}

void RelayedPorts::add_to(transport::WaitSet& wait) const noexcept {
  for (const Port& port : ports_) wait.add(port.socket.descriptor());
}

std::int64_t RelayedPorts::next_time_ns() const noexcept {
  return std::min(ports_[0].client.due_ns(), ports_[1].client.due_ns());
}

void RelayedPorts::on_time(std::int64_t now_ns) {
  for (Port& port : ports_)
    while (const auto out = port.client.next(now_ns)) port.socket.send_to(out->to, out->bytes);
}

void RelayedPorts::heard_at(transport::LaneKind lane, std::int64_t heard_ns, std::int64_t now_ns) {
  if (now_ns - heard_ns > kSilence_ns) ports_[static_cast<std::size_t>(lane)].client.note_silence(now_ns);
}

RelayedPorts::Port* RelayedPorts::port_of(const transport::Received& received) noexcept {
  for (Port& port : ports_)
    if (port.socket.local().port == received.to.port) return &port;
  return nullptr;
}

// In turn, so that a flood on one does not silence the other.
std::optional<transport::Received> RelayedPorts::receive(std::span<std::byte> buffer) noexcept {
  takes_turns_ = !takes_turns_;
  if (auto received = ports_[takes_turns_ ? 0 : 1].socket.receive(buffer)) return received;
  return ports_[takes_turns_ ? 1 : 0].socket.receive(buffer);
}

bool RelayedPorts::take(const transport::Received& received, std::int64_t now_ns) {
  Port* const port = port_of(received);
  return port != nullptr && port->client.receive(received.from, received.bytes, now_ns);
}

bool RelayedPorts::answer(const transport::Received& question, std::span<const std::byte> datagram) noexcept {
  Port* const port = port_of(question);
  if (port == nullptr) return false;
  port->socket.send_from(question.to, question.from, datagram);
  return true;
}

// The bulk lane's port speaks for both.
std::string RelayedPorts::news(std::int64_t now_ns) {
  const transport::RelayClient& client = ports_[static_cast<std::size_t>(transport::LaneKind::kBulk)].client;
  std::string line = told_;
  if (const auto trouble = client.trouble(now_ns)) {
    line = trouble->message;
  } else if (client.own() && client.state(now_ns) != transport::RelayClient::State::kAsking) {
    line = "masters may come over the relay, which sees this slave at " + transport::to_string(*client.own());
  }
  if (line == told_) return {};
  return told_ = line;
}

}  // namespace farfeel::slave_sim
