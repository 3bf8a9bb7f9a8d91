// Key pairs, and a key that seals messages so that only its other holder reads them and nobody changes them.
//
// Two suites do the same job. AES-256-GCM is faster where the processor has instructions for it; ChaCha20-Poly1305 runs
// on every processor. Both are strong, so it is no harm if somebody forces the one or the other.
// Nothing here opens a file or a socket, or asks for the time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farfeel::transport {

inline constexpr std::size_t kKeyBytes = 32;
inline constexpr std::size_t kTagBytes = 16;  ///< what a seal adds to the plain bytes

/// The numbers stand in the handshake's header.
enum class Suite : std::uint8_t { kAesGcm = 1, kChaChaPoly = 2 };

/// Whether this processor can run it. kChaChaPoly always is.
[[nodiscard]] bool is_available(Suite) noexcept;
[[nodiscard]] constexpr const char* name_of(Suite suite) noexcept {
  return suite == Suite::kAesGcm ? "AES-256-GCM" : "ChaCha20-Poly1305";
}

using Key32 = std::array<std::byte, kKeyBytes>;

/// Overwrites secrets so that no optimiser leaves it out.
void wipe(std::span<std::byte>) noexcept;
/// The time that it takes does not depend on where the two differ. False where the sizes differ.
[[nodiscard]] bool is_same_secret(std::span<const std::byte>, std::span<const std::byte>) noexcept;
void fill_randomly(std::span<std::byte>) noexcept;  ///< by the operating system's source
[[nodiscard]] Key32 random_key() noexcept;

/// A pair for X25519. The secret is wiped when the pair ends.
struct KeyPair {
  Key32 secret{};
  Key32 public_key{};

  ~KeyPair() { wipe(secret); }
};

[[nodiscard]] KeyPair new_key_pair() noexcept;
/// The pair that belongs to a secret that was kept.
[[nodiscard]] KeyPair key_pair_of(const Key32& secret) noexcept;
/// What two pairs share, X25519. Nothing where the public key is one of the few weak ones whose result is all zeros.
[[nodiscard]] std::optional<Key32> shared_secret(const KeyPair& own, const Key32& public_key) noexcept;

/// One direction's key. seal and open change nothing in it, so threads may share it. All of it is realtime-safe.
///
/// The nonce is Noise's: four zero bytes, then the counter, big-endian for AES-GCM and little-endian for ChaCha.
/// THE CALLER NEVER SEALS TWICE WITH THE SAME COUNTER: two messages under one nonce give the key's strength away.
class SealKey {
 public:
  /// Precondition: is_available(suite).
  SealKey(Suite suite, const Key32& key) noexcept;
  SealKey(const SealKey&) noexcept = default;
  SealKey& operator=(const SealKey&) noexcept = default;
  ~SealKey() { wipe(state_); }

  /// out is plain and kTagBytes more. In place is allowed: out may begin where plain begins. Other overlap is not.
  void seal(std::uint64_t counter, std::span<const std::byte> associated, std::span<const std::byte> plain,
            std::span<std::byte> out) const noexcept;
  /// out is sealed less kTagBytes, and may begin where sealed begins. False if anything was changed, or sealed with
  /// another key, counter or associated bytes; then out holds nothing of use.
  [[nodiscard]] bool open(std::uint64_t counter, std::span<const std::byte> associated,
                          std::span<const std::byte> sealed, std::span<std::byte> out) const noexcept;

  [[nodiscard]] Suite suite() const noexcept { return suite_; }

 private:
  // AES-GCM: libsodium's expanded key. ChaCha: the key itself, at the beginning.
  static constexpr std::size_t kStateBytes = 512;
  alignas(16) std::array<std::byte, kStateBytes> state_{};
  Suite suite_;
};

}  // namespace farfeel::transport
