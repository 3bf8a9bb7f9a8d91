// The handshake Noise_IKpsk2_25519_{AESGCM or ChaChaPoly}_BLAKE2b: two messages that prove to each end who the other is
// and leave both with the same fresh keys. Noise specification, revision 34; checked against its public test vectors.
//
//   IKpsk2:   <- s                           the initiator knows the responder's public key beforehand
//             -> e, es, s, ss  (payload)     first message
//             <- e, ee, se, psk  (payload)   second message
//
// e and s are an end's fresh and lasting key; two letters are what X25519 makes of the one end's and the other's. The
// first message can be replayed (a counter in its payload tells); whoever completes the second holds the secrets.
//
// Secrets are wiped when an object ends. An object serves one handshake, on one thread at a time. Nothing allocates;
// each message costs some 100 us of X25519, so none of it belongs in a haptic tick.
#pragma once

#include "transport/seal/suite.h"
#include "transport/seal/symmetric_state.h"

namespace farfeel::transport {

/// What the messages add to their payloads: e 32, sealed s 32 + 16, tag 16; and e 32, tag 16.
inline constexpr std::size_t kNoiseFirstBytes = kKeyBytes + kKeyBytes + 2 * kTagBytes;
inline constexpr std::size_t kNoiseSecondBytes = kKeyBytes + kTagBytes;

class NoiseInitiator {
 public:
  /// psk is 32 zero bytes where none is set. ephemeral is for test vectors alone: fresh in every handshake otherwise.
  /// Precondition: is_available(suite).
  NoiseInitiator(Suite suite, std::span<const std::byte> prologue, const KeyPair& own, const Key32& remote_public,
                 const Key32& psk, const KeyPair& ephemeral = new_key_pair()) noexcept;
  ~NoiseInitiator() { wipe(psk_); }
  NoiseInitiator(const NoiseInitiator&) = default;
  NoiseInitiator& operator=(const NoiseInitiator&) = default;

  /// The first message into out, which has room for payload and kNoiseFirstBytes. Returns its size, or 0 if
  /// remote_public is a weak key, out is too small, or the message was written already.
  [[nodiscard]] std::size_t write_first(std::span<const std::byte> payload, std::span<std::byte> out) noexcept;
  /// payload_out is message less kNoiseSecondBytes. Nothing if the message is not the answer to the first one, by who
  /// holds the responder's key; then nothing is changed, and the true answer can still come. Once only.
  [[nodiscard]] std::optional<SplitKeys> read_second(std::span<const std::byte> message,
                                                     std::span<std::byte> payload_out) noexcept;

 private:
  enum class Stage : std::uint8_t { kFresh, kWaits, kEnded };
  SymmetricState state_;
  KeyPair own_, ephemeral_;
  Key32 remote_, psk_;
  Stage stage_ = Stage::kFresh;
};

class NoiseResponder {
 public:
  /// ephemeral is for test vectors alone: otherwise it is made when it is needed, so that junk does not cost it.
  NoiseResponder(Suite suite, std::span<const std::byte> prologue, const KeyPair& own,
                 const std::optional<KeyPair>& ephemeral = std::nullopt) noexcept;

  /// The initiator's public key, which whoever sent this holds the secret of (or replays what its holder once sent).
  /// payload_out is message less kNoiseFirstBytes. Nothing if any byte is wrong; the object is of no use then.
  [[nodiscard]] std::optional<Key32> read_first(std::span<const std::byte> message,
                                                std::span<std::byte> payload_out) noexcept;
  /// After a read_first that gave a key, once. psk as the two agreed for that key, else 32 zero bytes; out is payload
  /// and kNoiseSecondBytes more.
  [[nodiscard]] SplitKeys write_second(const Key32& psk, std::span<const std::byte> payload,
                                       std::span<std::byte> out) noexcept;

 private:
  enum class Stage : std::uint8_t { kFresh, kMayAnswer, kEnded };
  SymmetricState state_;
  KeyPair own_;
  std::optional<KeyPair> ephemeral_;
  Key32 remote_ephemeral_{}, remote_{};
  Stage stage_ = Stage::kFresh;
};

}  // namespace farfeel::transport
