#include "master_station/editing/side_link.h"

#include <algorithm>
#include <array>

#include "master_station/session/greeter_of_keys.h"
#include "transport/net/wait_set.h"

namespace farfeel::master_station {
namespace {

constexpr const char* kThisMachine = "127.0.0.1";
constexpr int kMostDatagramsAtOnce = 256;  // between two looks at the clock

}  // namespace

tl::expected<SideLink, transport::Error> SideLink::open(const Options& options) {
  const auto addresses =
      transport::resolve(options.slave.empty() ? kThisMachine : options.slave, transport::kDefaultPort);
  if (!addresses) return tl::unexpected(addresses.error());
  const auto greeter = greeter_of_keys(options.keys, options.name, *addresses);
  if (!greeter) return tl::unexpected(greeter.error());
  const transport::Address& slave = addresses->front();
  auto socket = transport::UdpSocket::open_towards(slave, {.dscp = transport::Dscp::kLowerEffort});
  if (!socket) return tl::unexpected(socket.error());
  return SideLink(slave, *std::move(socket), *greeter, options.takes);
}

SideLink::SideLink(const transport::Address& slave, transport::UdpSocket socket, const transport::Greeter& greeter,
                   transport::SessionClient::Takes takes)
    : slave_(slave),
      socket_(std::move(socket)),
      client_(std::make_unique<transport::SessionClient>(greeter, transport::LaneKind::kSide, takes)) {}

void SideLink::look(double patience_s, const std::function<void(const transport::Message&)>& take) {
  const auto send_on = [this](transport::LaneKind, std::span<const std::byte> datagram) { socket_.send(datagram); };
  const std::int64_t before_ns = transport::monotonic_ns();
  client_->on_time(before_ns, send_on);
  transport::WaitSet wait;
  wait.add(socket_.descriptor());
  wait.wait_until(std::min(client_->next_time_ns(before_ns), before_ns + static_cast<std::int64_t>(1e9 * patience_s)));
  std::array<std::byte, transport::kMaxDatagramBytes> buffer;
  for (int i = 0; i < kMostDatagramsAtOnce; ++i) {
    const auto received = socket_.receive(buffer);
    if (!received) break;
    const auto message =
        client_->on_datagram(std::span(buffer).first(received->bytes.size()), received->time_ns, send_on);
    if (message) take(*message);
  }
  client_->on_time(transport::monotonic_ns(), send_on);
}

void SideLink::send(transport::MessageType type, std::span<const std::byte> payload) {
  client_->send_message(type, payload, transport::monotonic_ns(),
                        [this](transport::LaneKind, std::span<const std::byte> datagram) { socket_.send(datagram); });
}

void SideLink::end() {
  client_->end(transport::monotonic_ns(),
               [this](transport::LaneKind, std::span<const std::byte> datagram) { socket_.send(datagram); });
}

}  // namespace farfeel::master_station
