// Any datagrams from any addresses to an end's side of a relay. A record is: address, what is made right before it is
// sent, tenths of a second that pass, size, bytes. Made right are the nonce, the signature and the probes' secret.

#include <cstdlib>
#include <cstring>
#include <vector>

#include "transport/bytes/byte_cursor.h"
#include "transport/relay/relay_client.h"

using namespace farfeel::transport;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* input, std::size_t size) {
  RelayClient::Options options;
  options.relay = loopback().with_port(47200);
  options.token = make_token(Key32{}, {1, 2, 3, 4});
  options.room = "room";
  std::int64_t now_ns = 1'000'000'000'000;
  RelayClient client(options, now_ns);
  ByteReader reader(std::as_bytes(std::span(input, size)));
  std::uint64_t nonce = 0;
  Mac16 secret{};
  bool was_told_secret = false;
  while (reader.remaining() >= 4) {
    for (int most = 0;; ++most) {
      const auto out = client.next(now_ns);
      if (!out) break;
      if (most > 16) std::abort();  // it never stops
      if (const auto asked = read_register(out->bytes)) nonce = asked->nonce;
    }
    if (client.due_ns() <= now_ns) std::abort();
    Address from = options.relay;
    if (const std::uint8_t who = reader.u8() & 3) from.ip[3] = who;
    const std::uint8_t right = reader.u8();
    now_ns += reader.u8() * std::int64_t{100'000'000};
    const std::size_t size_of_body = reader.u8();
    const auto body = reader.bytes(std::min(size_of_body, reader.remaining()));
    std::vector<std::byte> bytes(body.begin(), body.end());
    bool is_true_probe = false;
    if ((right & 1) != 0 && bytes.size() >= 12 && bytes[0] != std::byte{20})
      std::memcpy(bytes.data() + 4, &nonce, sizeof nonce);
    if ((right & 2) != 0)
      if (auto message = read_registered(bytes)) {
        write(*message, options.token.key, bytes);
        if (message->peer) {
          secret = message->probe_secret;
          was_told_secret = true;
        }
      }
    if ((right & 4) != 0)
      if (auto message = read_probe(bytes)) {
        message->secret = secret;
        write(*message, bytes);
        is_true_probe = was_told_secret;
      }
    const Address before = client.path();
    const bool is_taken = client.receive(from, bytes, now_ns);
    if (is_taken != relay_type(bytes).has_value()) std::abort();
    if (client.path() != before && client.path() != options.relay && (!is_true_probe || client.path() != from)) {
      // A secret of zeros, which nobody was told, might be one all the same.
      const auto probe = read_probe(bytes);
      if (!probe || !was_told_secret || probe->secret != secret) std::abort();
    }
    if ((right & 128) != 0) client.note_silence(now_ns);
    (void)client.state(now_ns);
    (void)client.trouble(now_ns);
  }
  return 0;
}
