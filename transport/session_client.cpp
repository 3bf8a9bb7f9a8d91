#include "transport/session_client.h"

#include <algorithm>
#include <limits>

#include "transport/session_server.h"

namespace farfeel::transport {
namespace {

constexpr std::uint32_t kChunksPerAcknowledge = 4;
constexpr std::int64_t kAcknowledgeDelay_ns = 1'000'000;
constexpr std::int64_t kNoAnswer_ns = 3'000'000'000;  // then a person is told that nothing comes back at all
constexpr int kByes = 3;

std::string words(GreetingTrouble trouble) {
  switch (trouble) {
    case GreetingTrouble::kNone:
      return "no answer yet";
    case GreetingTrouble::kOtherVersion:
      return "what answers there speaks another version of the protocol: run the same release at both ends";
    case GreetingTrouble::kWrongSlaveKey:
      return "the slave there has another key than the one that is trusted here: compare 'farfeel key show' at the "
             "slave with 'farfeel key list' here, and if its key was renewed, trust the new one";
    case GreetingTrouble::kUnknownOperator:
      return "the slave does not know this operator's key: paste the line for the slave's machine that 'farfeel key "
             "show' prints here into a terminal there";
    case GreetingTrouble::kExpiredOperator:
      return "the trust in this operator's key has expired at the slave: paste the line for the slave's machine that "
             "'farfeel key show' prints here into a terminal there again, with a later --expires";
    case GreetingTrouble::kOldCounter:
      return "the slave has seen a later greeting of this key: an older copy of the key's folder is in use, or this "
             "machine's clock went back; the next greeting goes on from the clock";
    case GreetingTrouble::kBusy:
      return "another master has a session with this slave, which serves one at a time; it is free 2 s after that one "
             "ends";
    case GreetingTrouble::kNoSession:
      return "the slave no longer knows this session; it was probably restarted";
  }
  return {};
}

}  // namespace

SessionClient::SessionClient(const Greeter& greeter)
    : bulk_shake_(LaneKind::kBulk, greeter), haptic_shake_(LaneKind::kHaptic, greeter) {}

// The first datagram with new keys tells the slave that they are in use.
void SessionClient::on_keys(const LaneKeys& keys, std::int64_t now_ns) {
  bulk_.adopt(keys);
  heard_ns_ = now_ns;
  sent_ns_ = now_ns - kKeepAlive_ns;
  if (keys.session == session_ && keys.epoch == epoch_) return;
  session_ = keys.session;
  epoch_ = keys.epoch;
  has_offer_ = false;
  end_words_.clear();
  ++counters_.sessions;
  haptic_keys_.reset();
  haptic_shake_.set_session(uses_haptic_ ? session_ : 0);
}

void SessionClient::use_haptic(bool is_used) {
  if (is_used == uses_haptic_) return;
  uses_haptic_ = is_used;
  haptic_shake_.set_session(is_used ? session_ : 0);
}

void SessionClient::on_haptic_handshake(std::span<const std::byte> datagram, std::int64_t now_ns) {
  const auto keys = haptic_shake_.on_datagram(datagram, now_ns);
  if (keys && keys->session == session_ && keys->epoch == epoch_) haptic_keys_ = keys;
}

std::optional<LaneKeys> SessionClient::take_haptic_keys() {
  return std::exchange(haptic_keys_, std::nullopt);
}

std::optional<Message> SessionClient::on_datagram(std::span<std::byte> datagram, std::int64_t now_ns,
                                                  const Send& send) {
  const auto ignore = [&]() -> std::optional<Message> {
    ++counters_.ignored;
    return std::nullopt;
  };
  if (has_ended_) return ignore();
  if (receiver_index(datagram) == 0) {
    if (const auto keys = bulk_shake_.on_datagram(datagram, now_ns)) on_keys(*keys, now_ns);
    return std::nullopt;
  }
  const auto opened = bulk_.open(datagram, now_ns);
  if (!opened || opened->session != session_) return ignore();
  heard_ns_ = now_ns;
  bulk_shake_.heard_at(now_ns);
  const Message message{static_cast<MessageType>(opened->type), opened->message, opened->is_newest};
  switch (message.type) {
    case MessageType::kKeepAlive:
      return std::nullopt;
    case MessageType::kChallenge:
      send_message(MessageType::kChallengeAnswer, message.payload, now_ns, send);
      return std::nullopt;
    case MessageType::kOffer: {
      const auto offer = read_offer(message.payload);
      if (!offer) return ignore();
      receiver_.on_offer(*offer);
      has_offer_ = true;
      acknowledge(now_ns, send);
      return std::nullopt;
    }
    case MessageType::kChunk: {
      const auto chunk = read_chunk(message.payload);
      if (!chunk || !has_offer_) return ignore();
      receiver_.on_chunk(*chunk, now_ns);
      if (unacknowledged_++ == 0) unacknowledged_since_ns_ = now_ns;
      if (unacknowledged_ >= kChunksPerAcknowledge || has_offered_object()) acknowledge(now_ns, send);
      return std::nullopt;
    }
    case MessageType::kBye: {
      const auto bye = read_bye(message.payload);
      if (!bye) return ignore();
      end_words_ = bye->reason == ByeReason::kRevoked ? "the slave does not trust this operator's key any more"
                                                      : "the slave ended the session";
      bulk_.forget();
      bulk_shake_.restart(now_ns);
      haptic_shake_.set_session(0);
      session_ = 0;
      return std::nullopt;
    }
    case MessageType::kSlaveStatus:
      return message.is_newest ? std::optional(message) : ignore();
    case MessageType::kTile:
      return message;
    default:
      return ignore();
  }
}

void SessionClient::send_message(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = bulk_.seal(static_cast<std::uint8_t>(type), payload, datagram, now_ns);
  if (size == 0) return;
  sent_ns_ = now_ns;
  send(LaneKind::kBulk, std::span(datagram).first(size));
}

void SessionClient::acknowledge(std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  unacknowledged_ = 0;
  unacknowledged_since_ns_ = 0;
  send_message(MessageType::kAcknowledge, write(receiver_.acknowledge(now_ns), payload), now_ns, send);
}

void SessionClient::on_time(std::int64_t now_ns, const Send& send) {
  if (has_ended_) return;
  if (began_ns_ == 0) began_ns_ = now_ns;
  std::array<std::byte, kInitiationBytes> initiation;
  if (const std::size_t size = bulk_shake_.on_time(now_ns, initiation))
    send(LaneKind::kBulk, std::span(initiation).first(size));
  if (const std::size_t size = haptic_shake_.on_time(now_ns, initiation))
    send(LaneKind::kHaptic, std::span(initiation).first(size));
  if (session_ == 0) return;
  if (unacknowledged_ > 0 && now_ns - unacknowledged_since_ns_ >= kAcknowledgeDelay_ns) acknowledge(now_ns, send);
  if (now_ns - sent_ns_ >= kKeepAlive_ns) {
    sent_ns_ = now_ns;  // once a pause, also where there is nothing to seal with
    send_message(MessageType::kKeepAlive, {}, now_ns, send);
  }
}

std::int64_t SessionClient::next_time_ns(std::int64_t now_ns) const {
  if (has_ended_) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next = std::min(bulk_shake_.next_time_ns(now_ns), haptic_shake_.next_time_ns(now_ns));
  if (session_ != 0) next = std::min(next, sent_ns_ + kKeepAlive_ns);
  if (unacknowledged_ > 0) next = std::min(next, unacknowledged_since_ns_ + kAcknowledgeDelay_ns);
  return std::max(now_ns, next);
}

void SessionClient::haptic_heard_at(std::int64_t time_ns) {
  haptic_heard_ns_ = std::max(haptic_heard_ns_, time_ns);
  haptic_shake_.heard_at(time_ns);
}

bool SessionClient::is_heard(std::int64_t now_ns) const {
  return session_ != 0 && now_ns - std::max(heard_ns_, haptic_heard_ns_) <= kSilence_ns;
}

bool SessionClient::has_offered_object() const {
  return has_offer_ && receiver_.object() != nullptr && receiver_.has_whole_offer();
}

std::string SessionClient::trouble(std::int64_t now_ns) const {
  if (has_ended_) return "ended here";
  if (is_heard(now_ns)) return {};
  const GreetingTrouble trouble = bulk_shake_.trouble();
  if (trouble != GreetingTrouble::kNone) return words(trouble);
  if (!end_words_.empty()) return end_words_;
  if (session_ != 0) return "nothing was heard from the slave for 2 s";
  if (began_ns_ != 0 && now_ns - began_ns_ > kNoAnswer_ns)
    return "nothing comes back from there: either no farfeel-slave listens at that address and port, or UDP does not "
           "get through. See that the slave runs, that its firewall lets this UDP port in, that a router in front of "
           "it "
           "forwards the port, and that this network lets UDP out";
  return words(trouble);
}

void SessionClient::end(std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  const auto bye = write(Bye{ByeReason::kDone}, payload);
  for (int i = 0; i < kByes; ++i) send_message(MessageType::kBye, bye, now_ns, send);
  has_ended_ = true;
  session_ = 0;
  bulk_.forget();
}

}  // namespace farfeel::transport
