#include "transport/lane/handshake_server.h"

#include <algorithm>
#include <cstring>

namespace farfeel::transport {
namespace {

// An initiation that gets as far as X25519 costs 0.2 ms: so many a second are 2 % of a core, and far more than honest
// masters send. Beyond that senders must show that they receive what is sent to them.
constexpr double kFreeInitiations_per_s = 100, kFreeBurst = 50;
// Denials are a courtesy to people who set the link up; strangers get few.
constexpr double kDenials_per_s = 20, kDenialBurst = 20;

/// Lets through so many a second on average. Returns false when the bucket is full.
bool pours(double& level, std::int64_t& since_ns, std::int64_t now_ns, double per_s, double burst) {
  level = std::max(0.0, level - 1e-9 * static_cast<double>(now_ns - since_ns) * per_s);
  since_ns = now_ns;
  if (level >= burst) return false;
  level += 1;
  return true;
}

}  // namespace

HandshakeServer::HandshakeServer(const KeyPair& own, std::uint64_t epoch, Find find, Decide decide)
    : own_(own),
      epoch_(epoch),
      mac1_key_(mac1_key_of(own.public_key)),
      find_(std::move(find)),
      decide_(std::move(decide)),
      cookies_(own.public_key) {}

std::size_t HandshakeServer::deny(DenialReason reason, std::uint32_t sender_index, std::int64_t now_ns,
                                  std::span<std::byte> reply) {
  if (!pours(denials_, denials_ns_, now_ns, kDenials_per_s, kDenialBurst)) return 0;
  write_denial({kLinkVersion, reason, sender_index}, reply.first<kDenialBytes>());
  return kDenialBytes;
}

HandshakeServer::Result HandshakeServer::on_initiation(std::span<const std::byte> datagram, const Address& from,
                                                       std::int64_t now_ns, std::int64_t wall_ns,
                                                       std::span<std::byte, kResponseBytes> reply) {
  ++counters_.initiations;
  Result result;
  const InitiationHead head = read_initiation_head(datagram, mac1_key_);
  const auto denied = [&](DenialReason reason, std::uint64_t& counted) {
    ++counted;
    result.reply_bytes = deny(reason, head.sender_index, now_ns, reply);
    return result;
  };
  if (head.fault == HeadFault::kNotOurs) return ++counters_.malformed, result;
  if (head.fault == HeadFault::kWrongKey) return denied(DenialReason::kWrongKey, counters_.wrong_key);
  if (head.fault == HeadFault::kOtherVersion) return denied(DenialReason::kOtherVersion, counters_.other_version);
  if (head.fault == HeadFault::kOtherSuite) return denied(DenialReason::kOtherSuite, counters_.other_suite);

  const AddressBytes address = to_bytes(from);
  if (!pours(work_, work_ns_, now_ns, kFreeInitiations_per_s, kFreeBurst) &&
      !cookies_.is_mac2_right(datagram, address, now_ns)) {
    ++counters_.cookies;
    cookies_.write_reply(datagram, address, now_ns, reply.first<kCookieReplyBytes>());
    result.reply_bytes = kCookieReplyBytes;
    return result;
  }
  ResponderHandshake handshake(head, own_);
  const auto initiation = handshake.read_initiation(datagram);
  if (!initiation) return ++counters_.forged, result;
  const auto found = find_(initiation->sender);
  if (!found) return denied(DenialReason::kUnknownOperator, counters_.unknown);
  if (found->is_expired) return denied(DenialReason::kExpiredOperator, counters_.expired);

  Slot& slot = slots_[{initiation->sender, head.lane}];
  const auto question = datagram.first<kInitiationBytes - 2 * kMacBytes>();
  if (initiation->payload.counter == slot.counter && std::ranges::equal(question, slot.question)) {
    ++counters_.repeated;
    std::ranges::copy(slot.answer, reply.begin());
    result.reply_bytes = kResponseBytes;
    return result;
  }
  if (initiation->payload.counter <= slot.counter) return denied(DenialReason::kOldCounter, counters_.replayed);

  slot.counter = initiation->payload.counter;
  std::ranges::copy(question, slot.question.begin());
  result.applicant = {head.lane, initiation->sender, *found, initiation->payload.master, initiation->payload.session};
  const Admission admission = decide_(result.applicant);
  const std::uint32_t index = new_local_index(head.lane);
  const SplitKeys split =
      handshake.write_response(index, found->psk, {epoch_, admission.session, admission.verdict, wall_ns}, slot.answer);
  std::ranges::copy(slot.answer, reply.begin());
  result.reply_bytes = kResponseBytes;
  if (admission.verdict != Verdict::kWelcome) return ++counters_.busy, result;
  ++counters_.welcomed;
  result.keys = LaneKeys{++generations_[static_cast<std::size_t>(head.lane)],
                         head.suite,
                         index,
                         head.sender_index,
                         split.responder_to_initiator,
                         split.initiator_to_responder,
                         now_ns,
                         epoch_,
                         admission.session};
  return result;
}

void HandshakeServer::prune() {
  std::erase_if(slots_, [&](const auto& slot) { return !find_(slot.first.first); });
}

}  // namespace farfeel::transport
