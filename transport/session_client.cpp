#include "transport/session_client.h"

#include <algorithm>
#include <limits>

#include "transport/session_server.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kNoAnswer_ns = 3'000'000'000;  // then a person is told that nothing comes back at all
constexpr int kByes = 3;
constexpr int kMostAtOnce = 32;  // of one on_time(): bounds the time between two reads of the socket

// The scene that the loop simulates, one that came after it, and one that is coming.
constexpr std::uint64_t kSceneBytes = 3 * kMaxObjectBytes;
constexpr InboxLimits kInbox{.peer_bytes = kSceneBytes, .transfers = 1, .slots = 1};
constexpr InboxLimits kNoInbox{.peer_bytes = 0, .transfers = 0, .slots = 0};
constexpr InboxLimits kSavedInbox{
    .peer_bytes = 2 * kMaxObjectBytes, .transfers = 1, .slots = 1, .first_slot = kSavedSlot};

InboxLimits inbox_for(SessionClient::Takes takes) {
  if (takes == SessionClient::Takes::kNothing) return kNoInbox;
  return takes == SessionClient::Takes::kScene ? kInbox : kSavedInbox;
}

std::string words(ByeReason reason) {
  switch (reason) {
    case ByeReason::kDone:
      break;
    case ByeReason::kRevoked:
      return "the slave does not trust this operator's key any more";
    case ByeReason::kDisbelieved:
      return "the slave ended the session because this end acknowledged what was never sent to it: one of the two "
             "programs is faulty, or was changed";
  }
  return "the slave ended the session";
}

std::string words(GreetingTrouble trouble, LaneKind lane) {
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
      if (lane == LaneKind::kSide)
        return "as many watch or edit there as the slave has places for, eight in all and four of one key; try again "
               "when one of them has ended";
      return "another master has a session with this slave, which serves one at a time; it is free 2 s after that one "
             "ends";
    case GreetingTrouble::kNotAllowed:
      if (lane == LaneKind::kSide)
        return "the slave knows this key, and does not let it watch or edit: at the slave's machine run 'farfeel key "
               "trust operator NAME KEY --role operate,edit' with this machine's key";
      return "the slave lets this key watch or edit, and not operate: at the slave's machine run 'farfeel key trust "
             "operator NAME KEY --role operate' with this machine's key";
    case GreetingTrouble::kNoSession:
      return "the slave no longer knows this session; it was probably restarted";
  }
  return {};
}

}  // namespace

SessionClient::SessionClient(const Greeter& greeter, LaneKind lane, Takes takes)
    : lane_(lane),
      bulk_shake_(lane, greeter),
      haptic_shake_(LaneKind::kHaptic, greeter),
      bulk_(std::make_unique<BulkLane>(BulkOptions{.inbox = inbox_for(takes), .seed = random_identity()},
                                       std::make_shared<ByteBudget>(kSceneBytes))) {}

// The first datagram with new keys tells the slave that they are in use.
void SessionClient::on_keys(const LaneKeys& keys, std::int64_t now_ns) {
  seal_.adopt(keys);
  ++counters_.bulk_handshakes;
  heard_ns_ = now_ns;
  sent_ns_ = now_ns - kKeepAlive_ns;
  if (keys.session == session_ && keys.epoch == epoch_) return;
  session_ = keys.session;
  epoch_ = keys.epoch;
  bulk_->restart(random_identity(), bulk_shake_.round_trip_ns(), now_ns);
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

/// Greets anew, as a new session.
void SessionClient::leave(std::string why, std::int64_t now_ns) {
  end_words_ = std::move(why);
  seal_.forget();
  bulk_shake_.restart(now_ns);
  haptic_shake_.set_session(0);
  session_ = 0;
}

std::optional<Message> SessionClient::on_datagram(std::span<std::byte> datagram, std::int64_t now_ns,
                                                  const Send& send) {
  const auto ignore = [&]() -> std::optional<Message> {
    ++counters_.ignored;
    return std::nullopt;
  };
  if (has_ended_) return ignore();
  if (receiver_index(datagram) == 0) {
    if (!datagram.empty() && static_cast<DatagramType>(datagram[0]) == DatagramType::kInitiation) ++counters_.echoes;
    if (const auto keys = bulk_shake_.on_datagram(datagram, now_ns)) on_keys(*keys, now_ns);
    return std::nullopt;
  }
  const auto opened = seal_.open(datagram, now_ns);
  if (!opened || opened->session != session_) return ignore();
  heard_ns_ = now_ns;
  bulk_shake_.heard_at(now_ns);
  if (is_of_bulk(opened->type)) return on_bulk(*opened, now_ns, send);
  const Message message{static_cast<MessageType>(opened->type), opened->message, opened->is_newest};
  switch (message.type) {
    case MessageType::kKeepAlive:
      return std::nullopt;
    case MessageType::kChallenge:
      send_message(MessageType::kChallengeAnswer, message.payload, now_ns, send);
      return std::nullopt;
    case MessageType::kBye: {
      const auto bye = read_bye(message.payload);
      if (!bye) return ignore();
      leave(words(bye->reason), now_ns);
      return std::nullopt;
    }
    case MessageType::kEditAnswer:
    case MessageType::kSceneNews:
    case MessageType::kSaveAnswer:
      return lane_ == LaneKind::kSide ? std::optional(message) : ignore();
    case MessageType::kSlaveStatus:
      return message.is_newest ? std::optional(message) : ignore();
    default:
      return ignore();
  }
}

std::optional<Message> SessionClient::on_bulk(const SealedLane::Opened& opened, std::int64_t arrival_ns,
                                              const Send& send) {
  const std::uint64_t malformed = bulk_->counters().malformed;
  const auto body = bulk_->on_message(opened.plain(), arrival_ns);
  take_objects();
  if (bulk_->peer_lies()) {
    PayloadBuffer payload;
    const auto bye = write(Bye{ByeReason::kDisbelieved}, payload);
    for (int i = 0; i < kByes; ++i) send_message(MessageType::kBye, bye, arrival_ns, send);
    leave("the slave acknowledged what was never sent to it: one of the two programs is faulty, or was changed",
          arrival_ns);
    return std::nullopt;
  }
  if (body && body->type == BulkType::kTile) return Message{MessageType::kTile, body->bytes, opened.is_newest};
  if (body && body->type == BulkType::kCourse) return Message{MessageType::kCourse, body->bytes, opened.is_newest};
  counters_.ignored += body || bulk_->counters().malformed != malformed ? 1 : 0;
  return std::nullopt;
}

void SessionClient::take_objects() {
  while (auto object = bulk_->inbox().take_object())
    (object->slot == kSavedSlot ? saved_ : scene_) = std::move(*object);
}

void SessionClient::send_message(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = seal_.seal(static_cast<std::uint8_t>(type), payload, datagram, now_ns);
  if (size == 0) return;
  sent_ns_ = now_ns;
  send(LaneKind::kBulk, std::span(datagram).first(size));
}

void SessionClient::send_bulk(std::int64_t now_ns, const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const auto plain = std::span(datagram).subspan(kDataHeaderBytes, kMostMessageBytes);
  for (int i = 0; i < kMostAtOnce && seal_.can_send(now_ns); ++i) {
    const std::size_t bytes = bulk_->next(plain, now_ns);
    if (bytes == 0) break;
    const std::size_t size =
        seal_.seal(std::to_integer<std::uint8_t>(plain[0]), plain.subspan(1, bytes - 1), datagram, now_ns);
    sent_ns_ = now_ns;
    send(LaneKind::kBulk, std::span(datagram).first(size));
  }
  take_objects();  // it hashes on in next()
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
  send_bulk(now_ns, send);
  if (now_ns - sent_ns_ >= kKeepAlive_ns) {
    sent_ns_ = now_ns;  // once a pause, also where there is nothing to seal with
    send_message(MessageType::kKeepAlive, {}, now_ns, send);
  }
}

std::int64_t SessionClient::next_time_ns(std::int64_t now_ns) {
  if (has_ended_) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next = std::min(bulk_shake_.next_time_ns(now_ns), haptic_shake_.next_time_ns(now_ns));
  if (session_ != 0) next = std::min(next, sent_ns_ + kKeepAlive_ns);
  if (session_ != 0 && seal_.can_send(now_ns)) next = std::min(next, bulk_->next_time_ns(now_ns));
  return std::max(now_ns, next);
}

void SessionClient::haptic_heard_at(std::int64_t time_ns) {
  haptic_heard_ns_ = std::max(haptic_heard_ns_, time_ns);
  haptic_shake_.heard_at(time_ns);
}

bool SessionClient::is_heard(std::int64_t now_ns) const {
  return session_ != 0 && now_ns - std::max(heard_ns_, haptic_heard_ns_) <= kSilence_ns;
}

bool SessionClient::has_offered_scene() const {
  return session_ != 0 && scene_ && bulk_->inbox().is_here(kSceneSlot);
}

double SessionClient::progress() const {
  if (has_offered_scene()) return 1;
  const ObjectInbox::Progress progress = bulk_->inbox().progress();
  return progress.all == 0 ? 0 : static_cast<double>(progress.here) / static_cast<double>(progress.all);
}

std::string SessionClient::trouble(std::int64_t now_ns) const {
  if (has_ended_) return "ended here";
  if (is_heard(now_ns)) return {};
  const GreetingTrouble trouble = bulk_shake_.trouble();
  if (trouble != GreetingTrouble::kNone) return words(trouble, lane_);
  if (!end_words_.empty()) return end_words_;
  if (session_ != 0) return "nothing was heard from the slave for 2 s";
  if (counters_.echoes > 0)
    return "what answers there sends back what it gets, byte for byte: it is an echo service, not farfeel-slave. Start "
           "farfeel-slave there, or connect to the port that its --listen names";
  if (began_ns_ != 0 && now_ns - began_ns_ > kNoAnswer_ns)
    return "nothing comes back from there: either no farfeel-slave listens at that address and port, or UDP does not "
           "get through. See that the slave runs, that its firewall lets this UDP port in, that a router in front of "
           "it "
           "forwards the port, and that this network lets UDP out";
  return words(trouble, lane_);
}

void SessionClient::end(std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  const auto bye = write(Bye{ByeReason::kDone}, payload);
  for (int i = 0; i < kByes; ++i) send_message(MessageType::kBye, bye, now_ns, send);
  has_ended_ = true;
  session_ = 0;
  seal_.forget();
}

}  // namespace farfeel::transport
