// A history of datagrams at both ends of a live session. Each entry: u8 who, u16 length, that many bytes.
//   who & 1: to the slave, else to the master.  who & 2: from a stranger's address, else from the peer's own.
//   who & 4: the bytes are a message, u8 type and payload, sealed by the true peer, who is hostile; else a datagram as
//   it is, of somebody without keys.  who & 8: 100 ms pass first.
// Without keys nothing of the session changes, whatever is sent and from wherever, and no answer is larger than its
// question. With keys anything may end, and nothing may break.

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "transport/session_client.h"
#include "transport/session_server.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const auto scene = make_object(std::vector<std::byte>(3000, std::byte{7}));
  static const Address peer = loopback().with_port(5000), stranger = loopback().with_port(6000);
  static const KeyPair slave = key_pair_of({std::byte{1}}), master = key_pair_of({std::byte{2}});
  const auto find = [](const Key32& key) -> std::optional<Operator> {
    if (key != master.public_key) return std::nullopt;
    return Operator{"anna", {}, false};
  };
  SessionServer server({slave, 1, find, scene});
  std::int64_t now = 1;
  Greeter greeter;
  greeter.own = master;
  greeter.slave = slave.public_key;
  greeter.master = 2;
  greeter.next_counter = [next = std::uint64_t{0}]() mutable { return ++next; };
  greeter.wall_clock_ns = [&now] { return now; };
  greeter.suite = Suite::kChaChaPoly;
  SessionClient client(greeter);
  std::vector<std::vector<std::byte>> to_master, to_slave;
  std::size_t answered = 0;
  const SessionServer::Send answer = [&](const Address& to, std::span<const std::byte> d) {
    answered += d.size();
    if (to == peer && to_master.size() < 1000) to_master.emplace_back(d.begin(), d.end());
  };
  const SessionClient::Send ask = [&](LaneKind lane, std::span<const std::byte> d) {
    if (lane == LaneKind::kBulk && to_slave.size() < 1000) to_slave.emplace_back(d.begin(), d.end());
  };
  const auto deliver = [&] {
    server.on_time(now, answer);
    client.on_time(now, ask);
    for (auto& d : std::exchange(to_slave, {})) server.on_datagram(peer, d, now, now, answer);
    for (auto& d : std::exchange(to_master, {})) (void)client.on_datagram(d, now, ask);
  };
  for (int i = 0; i < 12; ++i, now += 1'000'000) deliver();
  if (client.session() == 0 || !client.has_offered_scene()) std::abort();

  for (int entries = 0; size >= 3 && entries < 200; ++entries) {
    const std::uint8_t who = bytes[0];
    const std::size_t wanted = bytes[1] | bytes[2] << 8;
    bytes += 3;
    size -= 3;
    const std::size_t length = std::min({wanted, size, kMaxDatagramBytes});
    std::vector<std::byte> datagram(length);
    if (length > 0) std::memcpy(datagram.data(), bytes, length);
    bytes += length;
    size -= length;
    if ((who & 8) != 0) now += 100'000'000;
    const Address& from = (who & 2) != 0 ? stranger : peer;
    const bool is_sealed = (who & 4) != 0 && length > 0;
    const auto type = length > 0 ? static_cast<MessageType>(datagram[0]) : MessageType::kKeepAlive;
    if (is_sealed && (who & 1) != 0) {
      client.send_message(type, std::span(datagram).subspan(1), now,
                          [&](LaneKind, std::span<const std::byte> d) { datagram.assign(d.begin(), d.end()); });
    } else if (is_sealed) {
      server.send_message(type, std::span(datagram).subspan(1), now,
                          [&](const Address&, std::span<const std::byte> d) { datagram.assign(d.begin(), d.end()); });
    }
    if ((who & 1) == 0) {
      const std::uint32_t before = client.session();
      (void)client.on_datagram(datagram, now, ask);
      if (!is_sealed && client.session() != before) std::abort();
    } else {
      const auto before = server.session();
      const auto before_address = server.bulk_address();
      answered = 0;
      const std::size_t asked = datagram.size();
      server.on_datagram(from, datagram, now, now, answer);
      if (!is_sealed) {
        if (answered > asked) std::abort();
        if (server.session().has_value() != before.has_value() || server.bulk_address() != before_address) std::abort();
        if (before && server.session()->id != before->id) std::abort();
      }
    }
    deliver();
  }
  return 0;
}
