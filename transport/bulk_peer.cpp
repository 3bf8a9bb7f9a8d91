#include "transport/bulk_peer.h"

#include <algorithm>
#include <array>

namespace farfeel::transport {
namespace {

constexpr int kMostAtOnce = 32;  // of one on_time(): bounds the time between two reads of the socket
constexpr int kByes = 3;
constexpr InboxLimits kInbox{.peer_bytes = 0, .transfers = 0, .slots = 0};  // nobody sends objects to a slave

}  // namespace

BulkPeer::BulkPeer() : bulk_({.inbox = kInbox, .seed = random_identity()}, std::make_shared<ByteBudget>(0)) {}

void BulkPeer::begin(SealedLane&& seal, const Address& asked_from, std::int64_t round_trip_ns, std::int64_t now_ns) {
  seal_ = std::move(seal);
  path_.on_handshake(asked_from, seal_.newest_generation());
  bulk_.restart(random_identity(), round_trip_ns, now_ns);
}

void BulkPeer::renew(const LaneKeys& keys, const Address& asked_from) {
  seal_.adopt(keys);
  path_.on_handshake(asked_from, keys.generation);
}

void BulkPeer::forget() {
  seal_.forget();
  path_.forget();
  sent_ns_ = 0;
}

void BulkPeer::follow(const Address& from, std::size_t bytes, const SealedLane::Opened& opened) {
  const std::optional<Address> before = path_.address();
  path_.on_authentic(from, bytes, opened.is_newest, opened.generation);
  if (path_.address() == before) return;
  bulk_.set_overhead(kSealedBytes + overhead_to(*path_.address()));
  if (before) bulk_.on_new_path(0);
}

BulkPeer::Read BulkPeer::read(const Address& from, const SealedLane::Opened& opened, std::int64_t now_ns) {
  if (is_of_bulk(opened.type)) {
    const std::uint64_t malformed = bulk_.counters().malformed;
    const auto body = bulk_.on_message(opened.plain(), now_ns);
    return {body || bulk_.counters().malformed != malformed, std::nullopt};
  }
  const Message message{static_cast<MessageType>(opened.type), opened.message, opened.is_newest};
  if (message.type == MessageType::kKeepAlive) return {};
  if (message.type == MessageType::kChallengeAnswer) {
    path_.on_answer(from, message.payload);
    return {};
  }
  return {false, message};
}

void BulkPeer::send(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns, const Send& send) {
  if (!path_.address() || !path_.may_send(payload.size() + kSealBytes, type == MessageType::kChallenge)) return;
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = seal_.seal(static_cast<std::uint8_t>(type), payload, datagram, now_ns);
  if (size == 0) return;
  sent_ns_ = now_ns;
  path_.on_sent(size);
  send(*path_.address(), std::span(datagram).first(size));
}

void BulkPeer::say_bye(ByeReason reason, std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  const auto bye = write(Bye{reason}, payload);
  for (int i = 0; i < kByes; ++i) this->send(MessageType::kBye, bye, now_ns, send);
}

void BulkPeer::send_bulk(std::int64_t now_ns, const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const auto plain = std::span(datagram).subspan(kDataHeaderBytes, kMostMessageBytes);
  for (int i = 0; i < kMostAtOnce && seal_.can_send(now_ns); ++i) {
    const std::size_t bytes = bulk_.next(plain, now_ns);
    if (bytes == 0) break;
    const std::size_t size =
        seal_.seal(std::to_integer<std::uint8_t>(plain[0]), plain.subspan(1, bytes - 1), datagram, now_ns);
    sent_ns_ = now_ns;
    path_.on_sent(size);
    send(*path_.address(), std::span(datagram).first(size));
  }
}

void BulkPeer::on_time(std::int64_t now_ns, const Send& send) {
  if (const auto challenge = path_.challenge(now_ns)) this->send(MessageType::kChallenge, *challenge, now_ns, send);
  if (path_.is_proven()) send_bulk(now_ns, send);
  if (now_ns - sent_ns_ >= kKeepAlive_ns) this->send(MessageType::kKeepAlive, {}, now_ns, send);
}

std::int64_t BulkPeer::next_time_ns(std::int64_t now_ns) {
  const std::int64_t next = std::max(sent_ns_, now_ns - kKeepAlive_ns / 2) + kKeepAlive_ns;
  if (!path_.is_proven()) return std::min(next, now_ns + PeerPath::kChallengeAgain_ns);
  return seal_.can_send(now_ns) ? std::min(next, bulk_.next_time_ns(now_ns)) : next;
}

}  // namespace farfeel::transport
