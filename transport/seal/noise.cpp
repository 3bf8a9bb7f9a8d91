#include "transport/seal/noise.h"

#include <algorithm>
#include <cstdlib>

namespace farfeel::transport {
namespace {

constexpr std::size_t kSealedKeyBytes = kKeyBytes + kTagBytes;

std::string_view protocol_name(Suite suite) {
  return suite == Suite::kAesGcm ? "Noise_IKpsk2_25519_AESGCM_BLAKE2b" : "Noise_IKpsk2_25519_ChaChaPoly_BLAKE2b";
}

// Mixes in what two keys share. False where the public one is weak: then the handshake ends.
bool mix_shared(SymmetricState& state, const KeyPair& own, const Key32& remote) {
  auto shared = shared_secret(own, remote);
  if (!shared) return false;
  state.mix_key(*shared);
  wipe(*shared);
  return true;
}

// The token e. In a handshake with a psk it is mixed into the key too (section 9.2 of the specification).
void mix_ephemeral(SymmetricState& state, const Key32& ephemeral) {
  state.mix_hash(ephemeral);
  state.mix_key(ephemeral);
}

Key32 key_at(std::span<const std::byte> message) {
  Key32 key;
  std::copy_n(message.begin(), key.size(), key.begin());
  return key;
}

}  // namespace

NoiseInitiator::NoiseInitiator(Suite suite, std::span<const std::byte> prologue, const KeyPair& own,
                               const Key32& remote_public, const Key32& psk, const KeyPair& ephemeral) noexcept
    : state_(suite, protocol_name(suite)), own_(own), ephemeral_(ephemeral), remote_(remote_public), psk_(psk) {
  state_.mix_hash(prologue);
  state_.mix_hash(remote_);
}

std::size_t NoiseInitiator::write_first(std::span<const std::byte> payload, std::span<std::byte> out) noexcept {
  const std::size_t size = payload.size() + kNoiseFirstBytes;
  if (stage_ != Stage::kFresh || out.size() < size) return 0;
  stage_ = Stage::kEnded;
  const auto e = out.first(kKeyBytes), s = out.subspan(kKeyBytes, kSealedKeyBytes);
  const auto sealed_payload = out.subspan(kKeyBytes + kSealedKeyBytes, payload.size() + kTagBytes);
  std::ranges::copy(ephemeral_.public_key, e.begin());
  mix_ephemeral(state_, ephemeral_.public_key);
  if (!mix_shared(state_, ephemeral_, remote_)) return 0;
  state_.encrypt_and_hash(own_.public_key, s);
  if (!mix_shared(state_, own_, remote_)) return 0;
  state_.encrypt_and_hash(payload, sealed_payload);
  stage_ = Stage::kWaits;
  return size;
}

std::optional<SplitKeys> NoiseInitiator::read_second(std::span<const std::byte> message,
                                                     std::span<std::byte> payload_out) noexcept {
  if (stage_ != Stage::kWaits || message.size() != payload_out.size() + kNoiseSecondBytes) return std::nullopt;
  SymmetricState state = state_;  // kept untouched until all of the message has proven right
  const Key32 e = key_at(message);
  mix_ephemeral(state, e);
  if (!mix_shared(state, ephemeral_, e) || !mix_shared(state, own_, e)) return std::nullopt;
  state.mix_key_and_hash(psk_);
  if (!state.decrypt_and_hash(message.subspan(kKeyBytes), payload_out)) return std::nullopt;
  stage_ = Stage::kEnded;
  return state.split();
}

NoiseResponder::NoiseResponder(Suite suite, std::span<const std::byte> prologue, const KeyPair& own,
                               const std::optional<KeyPair>& ephemeral) noexcept
    : state_(suite, protocol_name(suite)), own_(own), ephemeral_(ephemeral) {
  state_.mix_hash(prologue);
  state_.mix_hash(own_.public_key);
}

std::optional<Key32> NoiseResponder::read_first(std::span<const std::byte> message,
                                                std::span<std::byte> payload_out) noexcept {
  if (stage_ != Stage::kFresh || message.size() != payload_out.size() + kNoiseFirstBytes) return std::nullopt;
  stage_ = Stage::kEnded;
  remote_ephemeral_ = key_at(message);
  mix_ephemeral(state_, remote_ephemeral_);
  if (!mix_shared(state_, own_, remote_ephemeral_)) return std::nullopt;
  if (!state_.decrypt_and_hash(message.subspan(kKeyBytes, kSealedKeyBytes), remote_)) return std::nullopt;
  if (!mix_shared(state_, own_, remote_)) return std::nullopt;
  if (!state_.decrypt_and_hash(message.subspan(kKeyBytes + kSealedKeyBytes), payload_out)) return std::nullopt;
  stage_ = Stage::kMayAnswer;
  return remote_;
}

SplitKeys NoiseResponder::write_second(const Key32& psk, std::span<const std::byte> payload,
                                       std::span<std::byte> out) noexcept {
  // Bugs of the caller. A key of small order would have failed in read_first, which mixed both of the other end's keys
  // with ours, so that the two products below cannot fail.
  if (stage_ != Stage::kMayAnswer || out.size() != payload.size() + kNoiseSecondBytes) std::abort();
  stage_ = Stage::kEnded;
  if (!ephemeral_) ephemeral_ = new_key_pair();
  std::ranges::copy(ephemeral_->public_key, out.begin());
  mix_ephemeral(state_, ephemeral_->public_key);
  if (!mix_shared(state_, *ephemeral_, remote_ephemeral_) || !mix_shared(state_, *ephemeral_, remote_)) std::abort();
  state_.mix_key_and_hash(psk);
  state_.encrypt_and_hash(payload, out.subspan(kKeyBytes));
  return state_.split();
}

}  // namespace farfeel::transport
