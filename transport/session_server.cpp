#include "transport/session_server.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kOfferAgain_ns = 100'000'000;
constexpr int kBurstChunks = 32;  // of one on_time(): bounds the time between two reads of the socket
constexpr int kByes = 3;

std::uint32_t random_session() {
  std::uint32_t id = 0;
  while (id == 0) id = static_cast<std::uint32_t>(random_identity());
  return id;
}

}  // namespace

SessionServer::SessionServer(const Settings& settings)
    : find_(settings.find),
      shakes_(settings.own, settings.epoch, settings.find,
              [this](const Applicant& applicant) { return decide(applicant, now_ns_); }),
      object_(settings.object) {}

// The haptic lane joins a session that the bulk lane has made. A session that another process holds is free once both
// its lanes have been silent.
Admission SessionServer::decide(const Applicant& applicant, std::int64_t now_ns) {
  const bool is_own = session_ && session_->operator_key == applicant.key && session_->master == applicant.master;
  if (applicant.lane == LaneKind::kHaptic) {
    if (is_own && session_->id == applicant.session) return {Verdict::kWelcome, session_->id};
    return {Verdict::kNoSession, 0};
  }
  if (is_own) return {Verdict::kWelcome, session_->id};
  if (session_ && !is_silent(now_ns)) return {Verdict::kBusy, 0};
  return {Verdict::kWelcome, random_session()};
}

void SessionServer::on_initiation(const Address& from, std::span<const std::byte> datagram, std::int64_t now_ns,
                                  std::int64_t wall_ns, const Send& send) {
  now_ns_ = now_ns;
  std::array<std::byte, kResponseBytes> reply;
  const auto result = shakes_.on_initiation(datagram, from, now_ns, wall_ns, reply);
  if (result.keys) {
    const LaneKeys& keys = *result.keys;
    if (result.applicant.lane == LaneKind::kHaptic) {
      grant_ = {keys, from};
      haptic_indices_[next_haptic_index_++ % haptic_indices_.size()] = keys.local_index;
    } else if (session_ && keys.session == session_->id) {
      bulk_.adopt(keys);
      path_.on_handshake(from, keys.generation);
    } else {
      candidate_.emplace();
      candidate_->session = {keys.session, result.applicant.key, result.applicant.name, result.applicant.master, now_ns,
                             now_ns};
      candidate_->lane.adopt(keys);
      candidate_->asked_from = from;
    }
  }
  if (result.reply_bytes > 0) send(from, std::span(reply).first(result.reply_bytes));
}

void SessionServer::begin(Candidate&& candidate, std::int64_t now_ns) {
  drop("another master has come after a silence");
  session_ = std::move(candidate.session);
  session_->started_ns = session_->heard_ns = now_ns;
  bulk_ = std::move(candidate.lane);
  path_.on_handshake(candidate.asked_from, bulk_.newest_generation());
  if (object_) sender_.emplace(1, object_);
  ++counters_.sessions;
}

std::optional<Message> SessionServer::on_bulk(const Address& from, std::span<std::byte> datagram, std::int64_t now_ns) {
  const auto opened = [&]() -> std::optional<SealedLane::Opened> {
    if (!candidate_ || !candidate_->lane.knows(datagram)) return bulk_.open(datagram, now_ns);
    const auto first = candidate_->lane.open(datagram, now_ns);
    // Somebody else may have come meanwhile: then this one waits for its turn.
    if (!first || (session_ && !is_silent(now_ns))) return std::nullopt;
    begin(std::move(*candidate_), now_ns);
    candidate_.reset();
    return first;
  }();
  if (!opened || !session_) {
    ++counters_.ignored;
    return std::nullopt;
  }
  session_->heard_ns = now_ns;
  path_.on_authentic(from, datagram.size(), opened->is_newest, opened->generation);
  return Message{static_cast<MessageType>(opened->type), opened->message, opened->is_newest};
}

SessionServer::Outcome SessionServer::on_datagram(const Address& from, std::span<std::byte> datagram,
                                                  std::int64_t now_ns, std::int64_t wall_ns, const Send& send) {
  if (!datagram.empty() && datagram[0] == std::byte{static_cast<std::uint8_t>(DatagramType::kInitiation)}) {
    on_initiation(from, datagram, now_ns, wall_ns, send);
    return {};
  }
  if (const std::uint32_t index = receiver_index(datagram);
      index != 0 && std::ranges::find(haptic_indices_, index) != haptic_indices_.end())
    return {true, std::nullopt};
  const auto message = on_bulk(from, datagram, now_ns);
  if (!message) return {};
  switch (message->type) {
    case MessageType::kKeepAlive:
      return {};
    case MessageType::kChallengeAnswer:
      path_.on_answer(from, message->payload);
      return {};
    case MessageType::kTileAcknowledge:
      return {false, message};
    case MessageType::kAcknowledge:
      if (const auto ack = read_acknowledge(message->payload); ack && sender_) {
        sender_->on_acknowledge(*ack, now_ns);
        return {};
      }
      break;
    case MessageType::kBye:
      if (read_bye(message->payload)) {
        drop("the master said goodbye");
        return {};
      }
      break;
    default:
      break;
  }
  ++counters_.ignored;
  return {};
}

void SessionServer::send_in_session(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                    const Send& send) {
  if (!path_.address() || !path_.may_send(payload.size() + kSealBytes, type == MessageType::kChallenge)) return;
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = bulk_.seal(static_cast<std::uint8_t>(type), payload, datagram, now_ns);
  if (size == 0) return;
  sent_ns_ = now_ns;
  path_.on_sent(size);
  send(*path_.address(), std::span(datagram).first(size));
}

void SessionServer::on_time(std::int64_t now_ns, const Send& send) {
  if (!session_) return;
  if (!bulk_.can_send(now_ns) && is_silent(now_ns)) {
    drop("nothing was heard from the master while its keys lived");
    return;
  }
  if (is_silent(now_ns)) return;  // it may come back; until then nothing is said to nobody
  PayloadBuffer payload;
  if (const auto challenge = path_.challenge(now_ns))
    send_in_session(MessageType::kChallenge, *challenge, now_ns, send);
  if (sender_ && may_send_bulk()) {
    if (!sender_->is_wanted() && (offered_ns_ == 0 || now_ns - offered_ns_ >= kOfferAgain_ns)) {
      offered_ns_ = now_ns;
      send_in_session(MessageType::kOffer, write(sender_->offer(), payload), now_ns, send);
    }
    for (int i = 0; i < kBurstChunks; ++i) {
      const auto chunk = sender_->next_chunk(now_ns);
      if (!chunk) break;
      send_in_session(MessageType::kChunk, write(*chunk, payload), now_ns, send);
    }
  }
  if (now_ns - sent_ns_ >= kKeepAlive_ns) send_in_session(MessageType::kKeepAlive, {}, now_ns, send);
}

std::int64_t SessionServer::next_time_ns(std::int64_t now_ns) const {
  if (!session_ || is_silent(now_ns)) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next =
      std::min(session_->heard_ns + kSilence_ns + 1, std::max(sent_ns_, now_ns - kKeepAlive_ns / 2) + kKeepAlive_ns);
  if (!path_.is_proven()) {
    next = std::min(next, now_ns + PeerPath::kChallengeAgain_ns);
  } else if (sender_) {
    next = std::min(next, sender_->is_wanted() ? sender_->next_time_ns(now_ns) : offered_ns_ + kOfferAgain_ns);
  }
  return std::max(next, now_ns);
}

std::optional<HapticGrant> SessionServer::take_haptic_grant() {
  return std::exchange(grant_, std::nullopt);
}

void SessionServer::heard_at(std::int64_t time_ns) {
  if (session_) session_->heard_ns = std::max(session_->heard_ns, time_ns);
}

void SessionServer::send_message(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  if (session_) send_in_session(type, payload, now_ns, send);
}

void SessionServer::end(ByeReason reason, std::int64_t now_ns, const Send& send) {
  if (!session_) return;
  PayloadBuffer payload;
  const auto bye = write(Bye{reason}, payload);
  for (int i = 0; i < kByes; ++i) send_in_session(MessageType::kBye, bye, now_ns, send);
  drop(reason == ByeReason::kRevoked ? "the operator's key is not trusted any more" : "the slave ended it");
}

void SessionServer::on_changed_list(std::int64_t now_ns, const Send& send) {
  shakes_.prune();
  const auto is_trusted = [&](const ServedSession& session) {
    const auto found = find_(session.operator_key);
    return found && !found->is_expired;
  };
  if (candidate_ && !is_trusted(candidate_->session)) candidate_.reset();
  if (session_ && !is_trusted(*session_)) end(ByeReason::kRevoked, now_ns, send);
}

void SessionServer::drop(std::string why) {
  if (session_) last_end_ = std::move(why);
  session_.reset();
  sender_.reset();
  bulk_.forget();
  path_.forget();
  grant_.reset();
  haptic_indices_ = {};
  sent_ns_ = offered_ns_ = 0;
}

}  // namespace farfeel::transport
