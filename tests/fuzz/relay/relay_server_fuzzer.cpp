// Any datagrams from any addresses to a relay. A record is: address, what is made right before it is sent, seconds that
// pass, size, bytes. Made right are the cookie and the signature, which no fuzzer guesses.

#include <cstdlib>
#include <map>
#include <set>
#include <vector>

#include "transport/bytes/byte_cursor.h"
#include "transport/relay/relay_server.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* input, std::size_t size) {
  Key32 key{}, secret{};
  key[0] = secret[1] = std::byte{1};
  RelayServer server(key, secret);
  ByteReader reader(std::as_bytes(std::span(input, size)));
  std::int64_t now_ns = 1'000'000'000'000;
  const std::uint64_t wall_s = 1'700'000'000;
  std::map<AddressBytes, Mac16> cookies;  // what the relay gave each address
  std::set<AddressBytes> proven;          // those that sent theirs back
  std::map<AddressBytes, std::size_t> from_bytes, to_bytes_sent;
  std::size_t registrations = 0;
  while (reader.remaining() >= 4) {
    Address from = loopback().with_port(1000);
    from.ip[3] = reader.u8() & 7;
    const std::uint8_t right = reader.u8();
    now_ns += reader.u8() * std::int64_t{1'000'000'000};
    const std::size_t size_of_body = reader.u8();
    const auto body = reader.bytes(std::min(size_of_body, reader.remaining()));
    std::vector<std::byte> bytes(body.begin(), body.end());
    const AddressBytes at = to_bytes(from);
    if ((right & 1) != 0 && bytes.size() == RegisterMessage::kBytes) {
      if (auto message = read_register(bytes)) {
        if ((right & 2) != 0) message->cookie = cookies[at];
        if ((right & 4) != 0) message->grant = {message->grant.id & 3, wall_s + 50, message->grant.rate_kbit, 5};
        write(*message, make_token(key, message->grant).key, bytes);
        if ((right & 2) != 0 && cookies.contains(at)) proven.insert(at);
        ++registrations;
      }
    }
    Received received;
    received.bytes = bytes;
    received.from = from;
    received.to = loopback().with_port(47200);
    from_bytes[at] += bytes.size();
    for (const auto& out : server.receive(received, now_ns, wall_s)) {
      const AddressBytes to = to_bytes(out.to);
      to_bytes_sent[to] += out.bytes.size();
      if (const auto challenge = read_challenge(out.bytes)) cookies[to] = challenge->cookie;
      if (!proven.contains(to) && to_bytes_sent[to] > from_bytes[to]) std::abort();
    }
    if (server.ends() > registrations || server.ends() > 8) std::abort();
    if ((right & 128) != 0) server.forget(now_ns, wall_s);
  }
  return 0;
}
