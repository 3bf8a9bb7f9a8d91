#include "transport/seal/symmetric_state.h"

#include <sodium.h>

#include <algorithm>
#include <cstdlib>

namespace farfeel::transport {
namespace {

constexpr std::size_t kBlockBytes = 128;  // of BLAKE2b; HMAC pads its key to this

unsigned char* raw(std::byte* p) {
  return reinterpret_cast<unsigned char*>(p);
}
const unsigned char* raw(const std::byte* p) {
  return reinterpret_cast<const unsigned char*>(p);
}

using Pieces = std::initializer_list<std::span<const std::byte>>;

Hash64 blake2b(Pieces pieces) {
  crypto_generichash_state state;
  Hash64 hash;
  crypto_generichash_init(&state, nullptr, 0, hash.size());
  for (const auto& piece : pieces) crypto_generichash_update(&state, raw(piece.data()), piece.size());
  crypto_generichash_final(&state, raw(hash.data()), hash.size());
  sodium_memzero(&state, sizeof state);
  return hash;
}

// Noise's HKDF: temporary = HMAC(chaining key, input); output i = HMAC(temporary, output i - 1 | byte i).
class Hkdf {
 public:
  Hkdf(const Hash64& chaining_key, std::span<const std::byte> input)
      : temporary_(hmac_blake2b(chaining_key, input, {})) {}
  Hkdf(const Hkdf&) = delete;
  Hkdf& operator=(const Hkdf&) = delete;
  ~Hkdf() {
    wipe(temporary_);
    wipe(output_);
  }

  const Hash64& next() {
    const std::array number{static_cast<std::byte>(++count_)};
    const auto previous = count_ == 1 ? std::span<const std::byte>() : std::span<const std::byte>(output_);
    output_ = hmac_blake2b(temporary_, previous, number);
    return output_;
  }

 private:
  Hash64 temporary_, output_{};
  std::uint8_t count_ = 0;
};

// A key is the first half of a 64-byte output.
void truncate(const Hash64& from, Key32& to) {
  std::copy_n(from.begin(), to.size(), to.begin());
}

}  // namespace

Hash64 hmac_blake2b(std::span<const std::byte> key, std::span<const std::byte> first,
                    std::span<const std::byte> second) noexcept {
  if (key.size() > kBlockBytes) std::abort();  // no key of ours is longer
  std::array<std::byte, kBlockBytes> inner_pad{}, outer_pad{};
  std::copy(key.begin(), key.end(), inner_pad.begin());
  outer_pad = inner_pad;
  for (auto& b : inner_pad) b ^= std::byte{0x36};
  for (auto& b : outer_pad) b ^= std::byte{0x5c};
  Hash64 inner = blake2b({inner_pad, first, second});
  const Hash64 outer = blake2b({outer_pad, inner});
  wipe(inner_pad);
  wipe(outer_pad);
  wipe(inner);
  return outer;
}

SymmetricState::SymmetricState(Suite suite, std::string_view name) noexcept : suite_(suite) {
  if (name.size() > hash_.size()) std::abort();
  std::ranges::copy(std::as_bytes(std::span(name)), hash_.begin());
  chaining_key_ = hash_;
}

SymmetricState::~SymmetricState() {
  wipe(chaining_key_);
  wipe(hash_);
  wipe(key_);
}

void SymmetricState::mix_hash(std::span<const std::byte> bytes) noexcept {
  hash_ = blake2b({hash_, bytes});
}

void SymmetricState::mix_key(std::span<const std::byte> input) noexcept {
  Hkdf hkdf(chaining_key_, input);
  chaining_key_ = hkdf.next();
  truncate(hkdf.next(), key_);
  counter_ = 0;
}

void SymmetricState::mix_key_and_hash(std::span<const std::byte> input) noexcept {
  Hkdf hkdf(chaining_key_, input);
  chaining_key_ = hkdf.next();
  mix_hash(hkdf.next());
  truncate(hkdf.next(), key_);
  counter_ = 0;
}

void SymmetricState::encrypt_and_hash(std::span<const std::byte> plain, std::span<std::byte> out) noexcept {
  SealKey(suite_, key_).seal(counter_++, hash_, plain, out);
  mix_hash(out);
}

bool SymmetricState::decrypt_and_hash(std::span<const std::byte> sealed, std::span<std::byte> out) noexcept {
  // Hashed first, and kept: opening in place overwrites what is hashed.
  const Hash64 next_hash = blake2b({hash_, sealed});
  if (!SealKey(suite_, key_).open(counter_++, hash_, sealed, out)) return false;
  hash_ = next_hash;
  return true;
}

SplitKeys SymmetricState::split() const noexcept {
  SplitKeys keys;
  Hkdf hkdf(chaining_key_, {});
  truncate(hkdf.next(), keys.initiator_to_responder);
  truncate(hkdf.next(), keys.responder_to_initiator);
  keys.handshake_hash = hash_;
  return keys;
}

}  // namespace farfeel::transport
