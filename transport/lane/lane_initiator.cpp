#include "transport/lane/lane_initiator.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
LaneInitiator::LaneInitiator(LaneKind lane, const Greeter& greeter)
    : lane_(lane),
      greeter_(greeter),
      mac1_key_(mac1_key_of(greeter.own.public_key)),
      suite_(is_available(greeter.suite) ? greeter.suite : Suite::kChaChaPoly),
      cookies_(greeter.slave) {}

void LaneInitiator::set_session(std::uint32_t session) noexcept {
  if (session == session_) return;
  session_ = session;
  attempt_.reset();
  made_ns_ = heard_ns_ = trying_ns_ = next_send_ns_ = 0;
  trouble_ = GreetingTrouble::kNone;
}

void LaneInitiator::restart(std::int64_t now_ns) noexcept {
  attempt_.reset();
  made_ns_ = heard_ns_ = trying_ns_ = 0;
  next_send_ns_ = now_ns + kBusyAgain_ns;
}

void LaneInitiator::heard_at(std::int64_t time_ns) noexcept {
  heard_ns_ = std::max(heard_ns_, time_ns);
}

bool LaneInitiator::needs_keys(std::int64_t now_ns) const {
  if (lane_ == LaneKind::kHaptic && session_ == 0) return false;
  return made_ns_ == 0 || now_ns - made_ns_ > kRekey_ns || now_ns - std::max(heard_ns_, made_ns_) > kSilence_ns;
}

void LaneInitiator::begin(std::int64_t now_ns) {
  const std::uint32_t index = new_local_index(lane_);
  attempt_.emplace(
      Attempt{InitiatorHandshake(suite_, lane_, index, greeter_.own, greeter_.slave, greeter_.psk), {}, now_ns});
  const InitiationPayload payload{greeter_.next_counter(), greeter_.master, greeter_.wall_clock_ns(), session_};
  if (!attempt_->handshake.write_initiation(payload, attempt_->initiation)) attempt_.reset();
}

std::size_t LaneInitiator::on_time(std::int64_t now_ns, std::span<std::byte> to) {
  if (!needs_keys(now_ns)) {
    trying_ns_ = 0;  // an attempt under way is still welcome when it is answered
    return 0;
  }
  if (trying_ns_ == 0) {
    trying_ns_ = now_ns;
    next_send_ns_ = std::max(next_send_ns_, now_ns);
    pause_ns_ = generation_ == 0 ? kFirstAgain_ns : kAgain_ns;
  }
  if (now_ns < next_send_ns_ || to.size() < kInitiationBytes) return 0;
  if (!attempt_ || now_ns - attempt_->began_ns > (attempt_->is_denied ? kDenied_ns : kAttempt_ns)) begin(now_ns);
  if (!attempt_) return 0;
  cookies_.sign(attempt_->initiation, now_ns);
  std::ranges::copy(attempt_->initiation, to.begin());
  ++attempt_->sendings;
  ++initiations_;
  next_send_ns_ = now_ns + pause_ns_;
  if (generation_ == 0) {
    pause_ns_ = std::min(2 * pause_ns_, kFirstAgainLast_ns);
  } else if (now_ns - trying_ns_ > kEager_ns) {
    pause_ns_ = std::min(2 * pause_ns_, kAgainLast_ns);
  }
  return kInitiationBytes;
}

std::int64_t LaneInitiator::next_time_ns(std::int64_t now_ns) const {
  if (lane_ == LaneKind::kHaptic && session_ == 0) return std::numeric_limits<std::int64_t>::max();
  if (needs_keys(now_ns)) return std::max(now_ns, next_send_ns_);
  return std::min(made_ns_ + kRekey_ns, std::max(heard_ns_, made_ns_) + kSilence_ns) + 1;
}

std::optional<LaneKeys> LaneInitiator::on_response(std::span<const std::byte> datagram, std::int64_t now_ns) {
  const auto head = read_response_head(datagram, mac1_key_);
  if (!head || !attempt_ || head->receiver_index != attempt_->handshake.sender_index()) return std::nullopt;
  const auto response = attempt_->handshake.read_response(datagram);
  if (!response) return std::nullopt;
  clock_difference_ns_ = response->payload.wall_clock_ns - greeter_.wall_clock_ns();
  round_trip_ns_ = now_ns - attempt_->began_ns;
  if (attempt_->sendings > 1) round_trip_ns_ = std::min(round_trip_ns_, now_ns - next_send_ns_ + pause_ns_);
  const std::uint32_t local_index = attempt_->handshake.sender_index();
  suite_ = attempt_->handshake.suite();  // a denial may have named the other one: what is sealed is believed more
  attempt_.reset();
  if (response->payload.session == 0) {
    switch (response->payload.verdict) {
      case Verdict::kBusy:
        trouble_ = GreetingTrouble::kBusy;
        break;
      case Verdict::kNotAllowed:
        trouble_ = GreetingTrouble::kNotAllowed;
        break;
      default:
        trouble_ = GreetingTrouble::kNoSession;
    }
    next_send_ns_ = now_ns + (trouble_ == GreetingTrouble::kNoSession ? kAgain_ns : kBusyAgain_ns);
    return std::nullopt;
  }
  trouble_ = GreetingTrouble::kNone;
  made_ns_ = now_ns;
  trying_ns_ = 0;
  return LaneKeys{++generation_,
                  suite_,
                  local_index,
                  response->sender_index,
                  response->keys.initiator_to_responder,
                  response->keys.responder_to_initiator,
                  now_ns,
                  response->payload.epoch,
                  response->payload.session};
}

void LaneInitiator::on_denial(const Denial& denial) {
  if (!attempt_ || denial.receiver_index != attempt_->handshake.sender_index()) return;
  switch (denial.reason) {
    case DenialReason::kOtherSuite:
      suite_ = Suite::kChaChaPoly;
      attempt_->is_denied = attempt_->handshake.suite() != suite_;
      return;
    case DenialReason::kOtherVersion:
      trouble_ = GreetingTrouble::kOtherVersion;
      return;
    case DenialReason::kWrongKey:
      trouble_ = GreetingTrouble::kWrongSlaveKey;
      return;
    case DenialReason::kUnknownOperator:
      trouble_ = GreetingTrouble::kUnknownOperator;
      return;
    case DenialReason::kExpiredOperator:
      trouble_ = GreetingTrouble::kExpiredOperator;
      return;
    case DenialReason::kOldCounter:
      trouble_ = GreetingTrouble::kOldCounter;
      attempt_->is_denied = true;  // another one has a greater counter
      return;
  }
}

std::optional<LaneKeys> LaneInitiator::on_datagram(std::span<const std::byte> datagram, std::int64_t now_ns) {
  if (datagram.empty()) return std::nullopt;
  switch (static_cast<DatagramType>(datagram[0])) {
    case DatagramType::kResponse:
      return on_response(datagram, now_ns);
    case DatagramType::kCookieReply:
      if (cookies_.read_reply(datagram, now_ns)) next_send_ns_ = std::min(next_send_ns_, now_ns);
      return std::nullopt;
    case DatagramType::kDenial:
      if (const auto denial = read_denial(datagram)) on_denial(*denial);
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace farfeel::transport
