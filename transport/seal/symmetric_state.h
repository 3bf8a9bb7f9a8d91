// What both ends of a Noise handshake compute alike: a chaining key, a hash of all that was said, and the key of the
// moment. Noise specification, revision 34, section 5; the hash is BLAKE2b with 64 bytes. noise.h is built on this.
//
// Secrets are wiped when a state ends. One thread at a time; nothing allocates.
#pragma once

#include <string_view>

#include "transport/seal/suite.h"

namespace farfeel::transport {

using Hash64 = std::array<std::byte, 64>;

/// HMAC with BLAKE2b-512 (RFC 2104; block of 128 bytes), over two pieces one after the other.
[[nodiscard]] Hash64 hmac_blake2b(std::span<const std::byte> key, std::span<const std::byte> first,
                                  std::span<const std::byte> second) noexcept;

/// What a finished handshake leaves: one key a direction, and the hash that both ends agree on. Wiped when it ends.
struct SplitKeys {
  Key32 initiator_to_responder{};
  Key32 responder_to_initiator{};
  Hash64 handshake_hash{};

  ~SplitKeys() {
    wipe(initiator_to_responder);
    wipe(responder_to_initiator);
  }
};

class SymmetricState {
 public:
  /// name: as "Noise_IKpsk2_25519_AESGCM_BLAKE2b", at most 64 characters.
  SymmetricState(Suite suite, std::string_view name) noexcept;
  SymmetricState(const SymmetricState&) noexcept = default;
  SymmetricState& operator=(const SymmetricState&) noexcept = default;
  ~SymmetricState();

  void mix_hash(std::span<const std::byte>) noexcept;
  void mix_key(std::span<const std::byte>) noexcept;
  void mix_key_and_hash(std::span<const std::byte>) noexcept;
  /// out is plain and kTagBytes more. Precondition: a key was mixed in.
  void encrypt_and_hash(std::span<const std::byte> plain, std::span<std::byte> out) noexcept;
  /// out is sealed less kTagBytes. After false the state is of no use.
  [[nodiscard]] bool decrypt_and_hash(std::span<const std::byte> sealed, std::span<std::byte> out) noexcept;
  [[nodiscard]] SplitKeys split() const noexcept;

 private:
  Suite suite_;
  Hash64 chaining_key_{}, hash_{};
  Key32 key_{};
  std::uint64_t counter_ = 0;
};

}  // namespace farfeel::transport
