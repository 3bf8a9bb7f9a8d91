// A history of datagrams at both ends of a live session. Each entry: u8 who, u16 length, that many bytes.
//   who & 1: to the slave, else to the master.  who & 2: from a stranger, else from the peer's own address.
//   who & 4: with the live session's number put in.  who & 8: 100 ms pass first.
// A stranger must change nothing of the peer's session at the slave, even with its number. (One who has seen the
// master's random identity in a hello can greet in its name: until sessions are authenticated, that is the master.)

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "transport/session_client.h"
#include "transport/session_server.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const auto scene = make_object(std::vector<std::byte>(3000, std::byte{7}));
  static const Address peer = loopback().with_port(5000), stranger = loopback().with_port(6000);
  SessionServer server(1, scene);
  SessionClient client(2);
  std::int64_t now = 1;
  std::vector<std::vector<std::byte>> to_master, to_slave;
  const SessionServer::Send answer = [&](const Address& to, std::span<const std::byte> d) {
    if (to == peer && to_master.size() < 1000) to_master.emplace_back(d.begin(), d.end());
  };
  const SessionClient::Send ask = [&](std::span<const std::byte> d) {
    if (to_slave.size() < 1000) to_slave.emplace_back(d.begin(), d.end());
  };
  const auto deliver = [&] {
    server.on_time(now, answer);
    client.on_time(now, ask);
    for (const auto& d : std::exchange(to_slave, {})) server.on_datagram(peer, d, now, answer);
    for (const auto& d : std::exchange(to_master, {})) (void)client.on_datagram(d, now, ask);
  };
  for (int i = 0; i < 8; ++i, now += 1'000'000) deliver();
  if (client.state() != SessionClient::State::kConnected || !client.has_offered_object()) std::abort();

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
    const std::uint32_t id = server.session() ? server.session()->id : client.session();
    if ((who & 4) != 0 && length >= kHeaderBytes) std::memcpy(datagram.data() + 8, &id, 4);
    if ((who & 8) != 0) now += 100'000'000;
    const bool is_stranger = (who & 2) != 0;
    if ((who & 1) == 0) {
      (void)client.on_datagram(datagram, now, ask);
    } else {
      const auto before = server.session();
      server.on_datagram(is_stranger ? stranger : peer, datagram, now, answer);
      if (is_stranger && before && before->is_used && before->master == 2 && before->address == peer) {
        const bool is_hello_of_the_master = server.session() && server.session()->id != before->id;
        if (!is_hello_of_the_master && (!server.session() || server.session()->address != before->address))
          std::abort();
      }
    }
    deliver();
  }
  return 0;
}
