#include "transport/relay/relay_client.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

// Registering: each 250 ms at first, then ever more rarely; while nobody is there often enough to notice soon if the
// relay's word of the peer was lost; later as often as most NATs want, which forget a way after 30 s or more.
constexpr std::int64_t kFirstRetry_ns = 250 * kMs, kLastRetry_ns = 4 * kSecond;
constexpr std::int64_t kAskAlone_ns = 2 * kSecond, kAskPaired_ns = 10 * kSecond, kAskRefused_ns = 5 * kSecond;

// Probing: the NATs of both ends must have seen one go out before one comes in, which takes a round trip or two.
constexpr std::int64_t kEagerProbes_ns = 2 * kSecond, kEagerInterval_ns = 50 * kMs;
constexpr std::int64_t kPatientProbes_ns = 30 * kSecond, kPatientInterval_ns = 500 * kMs,
                       kLateInterval_ns = 15 * kSecond;
constexpr int kMostFailures = 7;  // 1 s, 2 s, ... 64 s until the direct way is tried again
constexpr std::int64_t kLasting_ns = kSecond << (kMostFailures - 1);

std::string describe(const RefusedMessage& refusal, const RelayGrant& grant) {
  switch (refusal.reason) {
    case RelayRefusal::kUnknownToken:
      return "it does not know this token. Ask whoever runs the relay for one of `farfeel-relay token`";
    case RelayRefusal::kExpired: {
      const auto late_s = refusal.wall_clock_s - static_cast<std::int64_t>(grant.expiry_s);
      return "the token expired " + std::to_string(std::max<std::int64_t>(late_s, 0) / 3600) +
             " hours ago by the relay's clock. Ask whoever runs the relay for a new one";
    }
    case RelayRefusal::kFull:
      return "it is full, or this token's places are all taken. End another session, or ask for a token with more";
    case RelayRefusal::kSlotTaken:
      return "a newer program is registered in this room in the same role. End one of the two, or use another room";
    case RelayRefusal::kOtherVersion:
      return "it speaks another version. Install the same version of farfeel there and here";
  }
  return "";
}

}  // namespace

RelayClient::RelayClient(const Options& options, std::int64_t now_ns)
    : options_(options), room_(room_id(options.token, options.room)), start_ns_(now_ns), ask_ns_(now_ns) {}

std::uint64_t RelayClient::new_nonce() noexcept {
  std::array<std::byte, 8> bytes{};
  ByteWriter(bytes).u64(++nonces_made_);
  const Mac16 mac = keyed_mac(options_.random, bytes);
  std::uint64_t nonce = 0;
  std::memcpy(&nonce, mac.data(), sizeof nonce);
  return nonce;
}

std::optional<RelayClient::Outgoing> RelayClient::next(std::int64_t now_ns) {
  const auto probe = [&](const Address& to, bool has_heard) {
    write(ProbeMessage{options_.slot, has_heard, probe_secret_}, buffer_);
    return Outgoing{to, std::span(buffer_).first(ProbeMessage::kBytes)};
  };
  if (answers_size_ > 0) return probe(answers_[--answers_size_], true);
  if (now_ns >= ask_ns_) {
    former_nonce_ = nonce_;
    nonce_ = new_nonce();
    is_challenge_open_ = true;
    write(
        RegisterMessage{options_.role, options_.slot, nonce_, options_.instance, options_.token.grant, room_, cookie_},
        options_.token.key, buffer_);
    ask_ns_ = now_ns + std::min(kFirstRetry_ns << std::min(unanswered_ / 4, 8), kLastRetry_ns);
    ++unanswered_;
    return Outgoing{options_.relay, std::span(buffer_).first(RegisterMessage::kBytes)};
  }
  while (told_ && !proven_ && now_ns >= probe_ns_) {
    const std::optional<Address>& place = next_place_++ == 0 ? told_ : seen_;
    if (next_place_ == 2) {
      next_place_ = 0;
      const std::int64_t age = now_ns - probing_since_ns_;
      probe_ns_ = now_ns + (age < kEagerProbes_ns     ? kEagerInterval_ns
                            : age < kPatientProbes_ns ? kPatientInterval_ns
                                                      : kLateInterval_ns);
    }
    if (place) return probe(*place, false);
  }
  return std::nullopt;
}

std::int64_t RelayClient::due_ns() const noexcept {
  if (answers_size_ > 0) return std::numeric_limits<std::int64_t>::min();
  return std::min(ask_ns_, told_ && !proven_ ? probe_ns_ : kNever);
}

bool RelayClient::receive(const Address& from, std::span<const std::byte> datagram, std::int64_t now_ns) {
  if (!relay_type(datagram)) return false;
  if (const auto probe = read_probe(datagram)) {
    take_probe(from, *probe, now_ns);
  } else if (from != options_.relay) {
    // Somebody else has nothing to say to us.
  } else if (const auto challenge = read_challenge(datagram)) {
    if (challenge->nonce == nonce_ && is_challenge_open_) {
      is_challenge_open_ = false;
      cookie_ = challenge->cookie;
      ask_ns_ = now_ns;
    }
  } else if (const auto registered = read_registered(datagram)) {
    if (registered->slot == options_.slot && is_signed(datagram, options_.token.key) &&
        (registered->nonce == nonce_ || registered->nonce == former_nonce_))
      take_registered(*registered, now_ns);
  } else if (const auto refused = read_refused(datagram)) {
    if (refused->nonce == nonce_) {
      refusal_ = refused;
      ask_ns_ = now_ns + kAskRefused_ns;
    }
  }
  return true;
}

void RelayClient::take_registered(const RegisteredMessage& message, std::int64_t now_ns) {
  cookie_ = message.cookie;
  own_ = message.own;
  registered_ns_ = now_ns;
  refusal_.reset();
  unanswered_ = 0;
  is_peer_there_ = message.peer.has_value();
  is_challenge_open_ = false;
  ask_ns_ = now_ns + (message.peer ? kAskPaired_ns : kAskAlone_ns);
  // Without a peer there what is known of it stays: it may only be late in asking the relay again.
  if (!message.peer || (message.peer == told_ && message.probe_secret == probe_secret_)) return;
  if (message.probe_secret != probe_secret_) {
    seen_.reset();
    proven_.reset();
    failures_ = 0;
  }
  told_ = message.peer;
  probe_secret_ = message.probe_secret;
  probing_since_ns_ = probe_ns_ = now_ns;
  next_place_ = 0;
}

void RelayClient::take_probe(const Address& from, const ProbeMessage& message, std::int64_t now_ns) {
  if (!told_ || message.slot != options_.slot || !is_same_secret(message.secret, probe_secret_) ||
      from == options_.relay)
    return;
  if (from != *told_) seen_ = from;
  if (!message.has_heard) {
    if (answers_size_ < answers_.size()) answers_[answers_size_++] = from;
  } else if (!proven_ && now_ns >= probing_since_ns_) {
    proven_ = from;
    proven_ns_ = now_ns;
  }
}

void RelayClient::note_silence(std::int64_t now_ns) {
  if (proven_) {
    proven_.reset();
    if (now_ns - proven_ns_ >= kLasting_ns) failures_ = 0;
    failures_ = std::min(failures_ + 1, kMostFailures);
    probing_since_ns_ = probe_ns_ = now_ns + (kSecond << (failures_ - 1));
  }
  if (registered_ns_ && now_ns - *registered_ns_ >= kFirstRetry_ns && unanswered_ == 0) ask_ns_ = now_ns;
}

RelayClient::State RelayClient::state(std::int64_t now_ns) const noexcept {
  if (proven_) return State::kDirect;
  if (!registered_ns_ || now_ns - *registered_ns_ > kRelayLife_ns) return State::kAsking;
  return is_peer_there_ ? State::kRelayed : State::kAlone;
}

std::optional<Error> RelayClient::trouble(std::int64_t now_ns) const {
  const std::string where = "the relay at " + to_string(options_.relay);
  if (refusal_)
    return Error{ErrorKind::kRefused, where + " refused: " + describe(*refusal_, options_.token.grant) + "."};
  if (state(now_ns) == State::kAsking && now_ns - std::max(start_ns_, registered_ns_.value_or(start_ns_)) > kSilence_ns)
    return Error{ErrorKind::kTimeout,
                 where +
                     " does not answer. Check its address and that it runs; if it does, a firewall between stops UDP: "
                     "ask for its port to be let out, or try another network."};
  return std::nullopt;
}

}  // namespace farfeel::transport
