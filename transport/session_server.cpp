#include "transport/session_server.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

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
      sides_(settings.object) {
  if (settings.object) bulk().outbox().offer(kSceneSlot, settings.object, kSceneUrgency, 0);
}

// The haptic lane joins a session that the bulk lane has made. A session that another process holds is free once both
// its lanes have been silent.
Admission SessionServer::decide(const Applicant& applicant, std::int64_t now_ns) {
  if (applicant.lane == LaneKind::kSide) return sides_.decide(applicant, now_ns);
  if (!applicant.allowed.may_operate) return {Verdict::kNotAllowed, 0};
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
    if (result.applicant.lane == LaneKind::kSide) {
      sides_.on_keys(keys, from, now_ns);
    } else if (result.applicant.lane == LaneKind::kHaptic) {
      grant_ = {keys, from};
      haptic_indices_[next_haptic_index_++ % haptic_indices_.size()] = keys.local_index;
    } else if (session_ && keys.session == session_->id) {
      peer_.renew(keys, from);
      ++counters_.bulk_handshakes;
    } else {
      candidate_.emplace();
      candidate_->session = {
          keys.session, result.applicant.key, result.applicant.allowed.name, result.applicant.master, now_ns, now_ns};
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
  peer_.begin(std::move(candidate.lane), candidate.asked_from, round_trip_ns, now_ns);
  ++counters_.sessions;
}

std::optional<SealedLane::Opened> SessionServer::open(const Address& from, std::span<std::byte> datagram,
                                                      std::int64_t now_ns) {
  const auto opened = [&]() -> std::optional<SealedLane::Opened> {
    if (!candidate_ || !candidate_->lane.knows(datagram)) return peer_.open(datagram, now_ns);
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
  peer_.follow(from, datagram.size(), *opened);
  return opened;
}

SessionServer::Outcome SessionServer::on_datagram(const Address& from, std::span<std::byte> datagram,
                                                  std::int64_t now_ns, std::int64_t wall_ns, const Send& send) {
  if (!datagram.empty() && datagram[0] == std::byte{static_cast<std::uint8_t>(DatagramType::kInitiation)}) {
    on_initiation(from, datagram, now_ns, wall_ns, send);
    return {};
  }
  if (const std::uint32_t index = receiver_index(datagram);
      index != 0 && std::ranges::find(haptic_indices_, index) != haptic_indices_.end())
    return {.is_for_haptic = true, .message = {}, .side = {}};
  if (auto side = sides_.on_datagram(from, datagram, now_ns, send)) {
    Outcome outcome;
    outcome.side = std::move(side);
    return outcome;
  }
  const auto opened = open(from, datagram, now_ns);
  if (!opened) return {};
  Outcome outcome;
  outcome.is_opened = true;
  const BulkPeer::Read read = peer_.read(from, *opened, now_ns);
  counters_.ignored += read.is_ignored ? 1 : 0;
  if (bulk().peer_lies()) end(ByeReason::kDisbelieved, now_ns, send);
  if (!read.message) return outcome;
  if (read.message->type == MessageType::kTileRequest || read.message->type == MessageType::kTilesHeld) {
    outcome.message = read.message;
  } else if (read.message->type == MessageType::kBye && read_bye(read.message->payload)) {
    drop("the master said goodbye");
  } else {
    ++counters_.ignored;
  }
  return outcome;
}

void SessionServer::on_time(std::int64_t now_ns, const Send& send) {
  sides_.on_time(now_ns, send);
  if (!session_) return;
  if (!is_silent(now_ns)) return peer_.on_time(now_ns, send);
  // It may come back; until then nothing is said to nobody.
  if (!peer_.seal().can_send(now_ns)) drop("nothing was heard from the master while its keys lived");
}

std::int64_t SessionServer::next_time_ns(std::int64_t now_ns) {
  const std::int64_t sides_ns = sides_.next_time_ns(now_ns);
  if (!session_ || is_silent(now_ns)) return sides_ns;
  return std::max(now_ns, std::min({sides_ns, session_->heard_ns + kSilence_ns + 1, peer_.next_time_ns(now_ns)}));
}

std::optional<HapticGrant> SessionServer::take_haptic_grant() {
  return std::exchange(grant_, std::nullopt);
}

void SessionServer::heard_at(std::int64_t time_ns) {
  if (session_) session_->heard_ns = std::max(session_->heard_ns, time_ns);
}

void SessionServer::send_message(MessageType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  if (session_) peer_.send(type, payload, now_ns, send);
}

void SessionServer::end(ByeReason reason, std::int64_t now_ns, const Send& send) {
  if (!session_) return;
  peer_.say_bye(reason, now_ns, send);
  drop(words(reason));
}

void SessionServer::on_changed_list(std::int64_t now_ns, const Send& send) {
  shakes_.prune();
  sides_.on_changed_list(find_, now_ns, send);
  const auto is_trusted = [&](const ServedSession& session) {
    const auto found = find_(session.operator_key);
    return found && !found->is_expired && found->may_operate;
  };
  if (candidate_ && !is_trusted(candidate_->session)) candidate_.reset();
  if (session_ && !is_trusted(*session_)) end(ByeReason::kRevoked, now_ns, send);
}

void SessionServer::drop(std::string why) {
  if (session_) last_end_ = std::move(why);
  session_.reset();
  peer_.forget();
  grant_.reset();
  haptic_indices_ = {};
}

}  // namespace farfeel::transport
