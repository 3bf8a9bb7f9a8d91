#include "transport/session_server.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

constexpr int kMostAtOnce = 32;  // of one on_time(): bounds the time between two reads of the socket
constexpr int kByes = 3;
constexpr InboxLimits kInbox{.peer_bytes = 0, .transfers = 0, .slots = 0};  // masters send no objects

std::uint32_t random_session() {
  std::uint32_t id = 0;
  while (id == 0) id = static_cast<std::uint32_t>(random_identity());
  return id;
}

const char* words(ByeReason reason) {
  switch (reason) {
    case ByeReason::kDone:
      break;
    case ByeReason::kRevoked:
      return "the operator's key is not trusted any more";
    case ByeReason::kDisbelieved:
      return "the master acknowledged what was never sent to it: one of the two programs is faulty, or was changed";
  }
  return "the slave ended it";
}

}  // namespace

SessionServer::SessionServer(const Settings& settings)
    : find_(settings.find),
      shakes_(settings.own, settings.epoch, settings.find,
              [this](const Applicant& applicant) { return decide(applicant, now_ns_); }),
      bulk_({.inbox = kInbox, .seed = random_identity()}, std::make_shared<ByteBudget>(0)) {
  if (settings.object) bulk_.outbox().offer(kSceneSlot, settings.object, kSceneUrgency, 0);
}

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
      seal_.adopt(keys);
      ++counters_.bulk_handshakes;
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
  // From the answer to the greeting until now: a round trip, or more where either was lost. Too long a one costs only
  // a longer beginning, for the rate is the same.
  const std::int64_t round_trip_ns = now_ns - session_->started_ns;
  session_->started_ns = session_->heard_ns = now_ns;
  seal_ = std::move(candidate.lane);
  path_.on_handshake(candidate.asked_from, seal_.newest_generation());
  bulk_.restart(random_identity(), round_trip_ns, now_ns);
  ++counters_.sessions;
}

std::optional<SealedLane::Opened> SessionServer::open(const Address& from, std::span<std::byte> datagram,
                                                      std::int64_t now_ns) {
  const auto opened = [&]() -> std::optional<SealedLane::Opened> {
    if (!candidate_ || !candidate_->lane.knows(datagram)) return seal_.open(datagram, now_ns);
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
  session_->heard_ns = std::max(session_->heard_ns, now_ns);
  const std::optional<Address> before = path_.address();
  path_.on_authentic(from, datagram.size(), opened->is_newest, opened->generation);
  if (path_.address() != before) {
    bulk_.set_overhead(kSealedBytes + overhead_to(*path_.address()));
    if (before) bulk_.on_new_path(0);
  }
  return opened;
}

void SessionServer::on_bulk(const SealedLane::Opened& opened, std::int64_t now_ns, const Send& send) {
  const std::uint64_t malformed = bulk_.counters().malformed;
  const auto body = bulk_.on_message(opened.plain(), now_ns);
  counters_.ignored += body || bulk_.counters().malformed != malformed ? 1 : 0;
  if (bulk_.peer_lies()) end(ByeReason::kDisbelieved, now_ns, send);
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
  const auto opened = open(from, datagram, now_ns);
  if (!opened) return {};
  Outcome outcome;
  outcome.is_opened = true;
  if (is_of_bulk(opened->type)) {
    on_bulk(*opened, now_ns, send);
    return outcome;
  }
  const Message message{static_cast<MessageType>(opened->type), opened->message, opened->is_newest};
  switch (message.type) {
    case MessageType::kKeepAlive:
      return outcome;
    case MessageType::kChallengeAnswer:
      path_.on_answer(from, message.payload);
      return outcome;
    case MessageType::kTileRequest:
      outcome.message = message;
      return outcome;
    case MessageType::kBye:
      if (read_bye(message.payload)) {
        drop("the master said goodbye");
        return outcome;
      }
      break;
    default:
      break;
  }
  ++counters_.ignored;
  return outcome;
}

void SessionServer::send_in_session(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                    const Send& send) {
  if (!path_.address() || !path_.may_send(payload.size() + kSealBytes, type == MessageType::kChallenge)) return;
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = seal_.seal(static_cast<std::uint8_t>(type), payload, datagram, now_ns);
  if (size == 0) return;
  sent_ns_ = now_ns;
  path_.on_sent(size);
  send(*path_.address(), std::span(datagram).first(size));
}

void SessionServer::send_bulk(std::int64_t now_ns, const Send& send) {
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

void SessionServer::on_time(std::int64_t now_ns, const Send& send) {
  if (!session_) return;
  if (!seal_.can_send(now_ns) && is_silent(now_ns)) {
    drop("nothing was heard from the master while its keys lived");
    return;
  }
  if (is_silent(now_ns)) return;  // it may come back; until then nothing is said to nobody
  if (const auto challenge = path_.challenge(now_ns))
    send_in_session(MessageType::kChallenge, *challenge, now_ns, send);
  if (may_send_bulk()) send_bulk(now_ns, send);
  if (now_ns - sent_ns_ >= kKeepAlive_ns) send_in_session(MessageType::kKeepAlive, {}, now_ns, send);
}

std::int64_t SessionServer::next_time_ns(std::int64_t now_ns) {
  if (!session_ || is_silent(now_ns)) return std::numeric_limits<std::int64_t>::max();
  std::int64_t next =
      std::min(session_->heard_ns + kSilence_ns + 1, std::max(sent_ns_, now_ns - kKeepAlive_ns / 2) + kKeepAlive_ns);
  if (!path_.is_proven()) {
    next = std::min(next, now_ns + PeerPath::kChallengeAgain_ns);
  } else if (seal_.can_send(now_ns)) {
    next = std::min(next, bulk_.next_time_ns(now_ns));
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
  drop(words(reason));
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
  seal_.forget();
  path_.forget();
  grant_.reset();
  haptic_indices_ = {};
  sent_ns_ = 0;
}

}  // namespace farfeel::transport
