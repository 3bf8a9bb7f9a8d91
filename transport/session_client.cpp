#include "transport/session_client.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

// One acknowledgement speaks for several chunks, and waits this long for them at most.
constexpr std::uint32_t kChunksPerAcknowledge = 4;
constexpr std::int64_t kAcknowledgeDelay_ns = 1'000'000;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

void SessionClient::send_packet(PacketType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                const Send& send) {
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const std::size_t size = write_packet({type, session_, session_ == 0 ? 0 : ++sequence_}, payload, datagram);
  if (size == 0) return;
  sent_ns_ = now_ns;
  send(std::span(datagram).first(size));
}

void SessionClient::greet_again(std::string why, std::int64_t at_ns) {
  if (state_ == State::kConnected) ++counters_.losses;
  state_ = State::kGreeting;
  session_ = 0;
  has_offer_ = false;
  unacknowledged_ = 0;
  unacknowledged_since_ns_ = 0;
  back_off_ns_ = kFirstBackOff_ns;
  next_hello_ns_ = at_ns;
  trouble_ = std::move(why);
}

void SessionClient::on_welcome(const Packet& packet, std::int64_t now_ns) {
  const auto welcome = read_welcome(packet.payload);
  // Only the newest session counts: a welcome to an older hello may come late.
  if (!welcome || welcome->master != master_ || welcome->attempt > attempt_ || welcome->attempt <= welcomed_attempt_ ||
      packet.header.session == 0) {
    ++counters_.ignored;
    return;
  }
  welcomed_attempt_ = welcome->attempt;
  if (session_ != packet.header.session) {
    session_ = packet.header.session;
    sequence_ = newest_status_ = 0;
    has_offer_ = false;
    ++counters_.welcomes;
  }
  state_ = State::kConnected;
  greeting_round_trip_ns_ = std::max<std::int64_t>(0, now_ns - welcome->t_echo_ns);
  heard_ns_ = now_ns;
  sent_ns_ = now_ns - kKeepAlive_ns;  // answer at once: the slave learns that the session is in use
  trouble_.clear();
}

void SessionClient::on_refusal(const Packet& packet, std::int64_t now_ns) {
  const auto refusal = read_refusal(packet.payload);
  if (refusal && refusal->reason == RefusalReason::kUnknownSession && state_ == State::kConnected &&
      packet.header.session == session_) {
    greet_again("the slave no longer knows this session; it was probably restarted", now_ns);
  } else if (refusal && refusal->reason == RefusalReason::kBusy && state_ == State::kGreeting &&
             refusal->master == master_) {
    trouble_ = "the slave refused: " + std::string(refusal->text);
  } else {
    ++counters_.ignored;
  }
}

std::optional<Packet> SessionClient::on_datagram(std::span<const std::byte> datagram, std::int64_t now_ns,
                                                 const Send& send) {
  const Packet packet = read_packet(datagram);
  const auto ignore = [&] {
    ++counters_.ignored;
    return std::nullopt;
  };
  if (packet.fault == HeaderFault::kOtherVersion && state_ == State::kGreeting)
    trouble_ = "what answers there speaks another version of the protocol: run the same release at both ends";
  if (!packet.ok() || state_ == State::kEnded) return ignore();
  if (packet.header.type == PacketType::kWelcome) {
    on_welcome(packet, now_ns);
    return std::nullopt;
  }
  if (packet.header.type == PacketType::kRefusal) {
    on_refusal(packet, now_ns);
    return std::nullopt;
  }
  if (state_ != State::kConnected || packet.header.session != session_) return ignore();
  switch (packet.header.type) {
    case PacketType::kKeepAlive:
      heard_ns_ = now_ns;
      return std::nullopt;
    case PacketType::kOffer: {
      const auto offer = read_offer(packet.payload);
      if (!offer) return ignore();
      heard_ns_ = now_ns;
      receiver_.on_offer(*offer);
      has_offer_ = true;
      acknowledge(now_ns, send);
      return std::nullopt;
    }
    case PacketType::kChunk: {
      const auto chunk = read_chunk(packet.payload);
      if (!chunk || !has_offer_) return ignore();
      heard_ns_ = now_ns;
      receiver_.on_chunk(*chunk, now_ns);
      if (unacknowledged_++ == 0) unacknowledged_since_ns_ = now_ns;
      if (unacknowledged_ >= kChunksPerAcknowledge || has_offered_object()) acknowledge(now_ns, send);
      return std::nullopt;
    }
    case PacketType::kBye: {
      const auto bye = read_bye(packet.payload);
      if (!bye) return ignore();
      greet_again("the slave ended the session", now_ns + kFirstBackOff_ns);
      return std::nullopt;
    }
    case PacketType::kSlaveStatus:
      heard_ns_ = now_ns;
      if (packet.header.sequence <= newest_status_) return ignore();
      newest_status_ = packet.header.sequence;
      return packet;
    case PacketType::kTile:
      heard_ns_ = now_ns;
      return packet;
    default:
      return ignore();
  }
}

void SessionClient::send_message(PacketType type, std::span<const std::byte> payload, std::int64_t now_ns,
                                 const Send& send) {
  if (state_ == State::kConnected) send_packet(type, payload, now_ns, send);
}

void SessionClient::acknowledge(std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  unacknowledged_ = 0;
  unacknowledged_since_ns_ = 0;
  send_packet(PacketType::kAcknowledge, write(receiver_.acknowledge(now_ns), payload), now_ns, send);
}

void SessionClient::on_time(std::int64_t now_ns, const Send& send) {
  PayloadBuffer payload;
  if (state_ == State::kConnected) {
    if (now_ns - heard_ns_ > kSilence_ns) {
      greet_again("nothing was heard from the slave for 2 s", now_ns);
    } else {
      if (unacknowledged_ > 0 && now_ns - unacknowledged_since_ns_ >= kAcknowledgeDelay_ns) acknowledge(now_ns, send);
      if (now_ns - sent_ns_ >= kKeepAlive_ns) {
        send_packet(PacketType::kKeepAlive, write(KeepAlive{}, payload), now_ns, send);
      }
    }
  }
  if (state_ == State::kGreeting && now_ns >= next_hello_ns_) {
    ++counters_.hellos;
    send_packet(PacketType::kHello, write(Hello{master_, ++attempt_, now_ns}, payload), now_ns, send);
    next_hello_ns_ = now_ns + back_off_ns_;
    back_off_ns_ = std::min(2 * back_off_ns_, kLastBackOff_ns);
  }
}

std::int64_t SessionClient::next_time_ns(std::int64_t now_ns) const {
  if (state_ == State::kEnded) return kNever;
  if (state_ == State::kGreeting) return std::max(now_ns, next_hello_ns_);
  std::int64_t next = std::min(heard_ns_ + kSilence_ns + 1, sent_ns_ + kKeepAlive_ns);
  if (unacknowledged_ > 0) next = std::min(next, unacknowledged_since_ns_ + kAcknowledgeDelay_ns);
  return std::max(now_ns, next);
}

void SessionClient::heard_at(std::int64_t time_ns) {
  heard_ns_ = std::max(heard_ns_, time_ns);
}

bool SessionClient::has_offered_object() const {
  return has_offer_ && receiver_.object() != nullptr && receiver_.has_whole_offer();
}

void SessionClient::end(const Send& send) {
  if (state_ == State::kConnected) {
    PayloadBuffer payload;
    const auto bye = write(Bye{ByeReason::kDone}, payload);
    for (int i = 0; i < 3; ++i) send_packet(PacketType::kBye, bye, sent_ns_, send);
  }
  state_ = State::kEnded;
  session_ = 0;
  trouble_ = "ended here";
}

}  // namespace farfeel::transport
