// Hostile bytes at every reader of a handshake. The first byte says how they arrive:
//   & 3: which of initiation, response, cookie reply and denial
//   & 4: the rest is the datagram as it is; else it is XORed onto a datagram that the true peer made just now
//   & 8: mac1 is made right again, as anybody can who knows the public key
// Only what the true peer made is accepted: whatever differs from it before the macs, and reads without a fault,
// aborts.

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "transport/seal/cookie.h"
#include "transport/seal/handshake.h"

using namespace farfeel::transport;

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::size_t kDatagramBytesMax = 1500;

struct Ends {
  KeyPair master = new_key_pair(), slave = new_key_pair();
  Key32 master_mac1_key = mac1_key_of(master.public_key), slave_mac1_key = mac1_key_of(slave.public_key);
};

void demand(bool is_so) {
  if (!is_so) std::abort();
}

Bytes arrived(const Bytes& genuine, std::span<const std::byte> input, std::uint8_t how, const Key32& mac1_key) {
  Bytes datagram;
  if ((how & 4) != 0) {
    datagram.assign(input.begin(), input.begin() + std::min(input.size(), kDatagramBytesMax));
  } else {
    datagram = genuine;
    for (std::size_t i = 0; i < std::min(input.size(), datagram.size()); ++i) datagram[i] ^= input[i];
  }
  if ((how & 8) != 0 && datagram.size() >= 2 * kMacBytes) write_mac1(mac1_key, datagram);
  return datagram;
}

bool is_same_before(std::size_t end, const Bytes& a, const Bytes& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.begin() + end, b.begin());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const Ends ends;
  if (size == 0) return 0;
  const std::uint8_t how = bytes[0];
  const auto input = std::as_bytes(std::span(bytes, size)).subspan(1);

  InitiatorHandshake initiator(Suite::kChaChaPoly, LaneKind::kBulk, 7, ends.master, ends.slave.public_key, kNoPsk);
  std::array<std::byte, kInitiationBytes> initiation;
  demand(initiator.write_initiation({1, 2, 3}, initiation));
  const Bytes genuine_initiation(initiation.begin(), initiation.end());

  switch (how & 3) {
    case 0: {
      const Bytes datagram = arrived(genuine_initiation, input, how, ends.slave_mac1_key);
      const InitiationHead head = read_initiation_head(datagram, ends.slave_mac1_key);
      if (!head.ok()) break;
      const bool is_genuine = is_same_before(kInitiationBytes - 2 * kMacBytes, datagram, genuine_initiation);
      demand(ResponderHandshake(head, ends.slave).read_initiation(datagram).has_value() == is_genuine);
      break;
    }
    case 1: {
      ResponderHandshake responder(read_initiation_head(initiation, ends.slave_mac1_key), ends.slave);
      demand(responder.read_initiation(initiation).has_value());
      std::array<std::byte, kResponseBytes> response;
      (void)responder.write_response(9, kNoPsk, {4, 5, Verdict::kWelcome, 6}, response);
      const Bytes genuine(response.begin(), response.end());
      const Bytes datagram = arrived(genuine, input, how, ends.master_mac1_key);
      (void)read_response_head(datagram, ends.master_mac1_key);
      const bool is_genuine = is_same_before(kResponseBytes - 2 * kMacBytes, datagram, genuine);
      demand(initiator.read_response(datagram).has_value() == is_genuine);
      if (!is_genuine) demand(initiator.read_response(genuine).has_value());
      break;
    }
    case 2: {
      CookieMaker maker(ends.slave.public_key);
      CookieJar jar(ends.slave.public_key);
      jar.sign(initiation, 0);
      std::array<std::byte, kCookieReplyBytes> reply;
      maker.write_reply(initiation, input.first(std::min<std::size_t>(input.size(), 18)), 0, reply);
      const Bytes genuine(reply.begin(), reply.end());
      // A reply has no macs: nothing is mended.
      const Bytes datagram = arrived(genuine, input, how & 7, ends.master_mac1_key);
      demand(jar.read_reply(datagram, 0) == (datagram == genuine));
      (void)maker.is_mac2_right(initiation, input, 0);
      break;
    }
    default: {
      std::array<std::byte, kDenialBytes> written;
      write_denial({kLinkVersion, DenialReason::kOtherSuite, 7}, written);
      const Bytes datagram = arrived(Bytes(written.begin(), written.end()), input, how & 7, ends.master_mac1_key);
      if (const auto denial = read_denial(datagram)) {
        write_denial(*denial, written);
        demand(std::equal(written.begin(), written.end(), datagram.begin(), datagram.end()));
      }
    }
  }
  return 0;
}
