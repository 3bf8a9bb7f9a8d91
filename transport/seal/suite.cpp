#include "transport/seal/suite.h"

#include <sodium.h>

#include <cstdlib>
#include <cstring>

namespace farfeel::transport {
namespace {

using Nonce = std::array<std::byte, 12>;
static_assert(crypto_aead_aes256gcm_NPUBBYTES == std::tuple_size_v<Nonce> &&
              crypto_aead_chacha20poly1305_ietf_NPUBBYTES == std::tuple_size_v<Nonce>);
static_assert(crypto_aead_aes256gcm_ABYTES == kTagBytes && crypto_aead_chacha20poly1305_ietf_ABYTES == kTagBytes);
static_assert(crypto_aead_aes256gcm_KEYBYTES == kKeyBytes && crypto_aead_chacha20poly1305_ietf_KEYBYTES == kKeyBytes);
static_assert(crypto_scalarmult_BYTES == kKeyBytes && crypto_scalarmult_SCALARBYTES == kKeyBytes);

// libsodium looks at the processor and opens its source of random numbers once.
void prepare_sodium() noexcept {
  static const bool is_ready = sodium_init() >= 0;
  if (!is_ready) std::abort();  // no source of random numbers: nothing may be built on that
}

unsigned char* raw(std::byte* p) {
  return reinterpret_cast<unsigned char*>(p);
}
const unsigned char* raw(const std::byte* p) {
  return reinterpret_cast<const unsigned char*>(p);
}

Nonce nonce_of(Suite suite, std::uint64_t counter) {
  Nonce nonce{};
  for (std::size_t i = 0; i < 8; ++i) {
    const std::size_t at = suite == Suite::kAesGcm ? 11 - i : 4 + i;
    nonce[at] = static_cast<std::byte>(counter >> (8 * i));
  }
  return nonce;
}

const crypto_aead_aes256gcm_state* aes_state(const std::byte* state) {
  return reinterpret_cast<const crypto_aead_aes256gcm_state*>(state);
}

}  // namespace

bool is_available(Suite suite) noexcept {
  if (suite == Suite::kChaChaPoly) return true;
  prepare_sodium();
  return suite == Suite::kAesGcm && crypto_aead_aes256gcm_is_available() == 1;
}

void wipe(std::span<std::byte> secret) noexcept {
  sodium_memzero(secret.data(), secret.size());
}

bool is_same_secret(std::span<const std::byte> a, std::span<const std::byte> b) noexcept {
  return a.size() == b.size() && (a.empty() || sodium_memcmp(a.data(), b.data(), a.size()) == 0);
}

void fill_randomly(std::span<std::byte> bytes) noexcept {
  prepare_sodium();
  if (!bytes.empty()) randombytes_buf(bytes.data(), bytes.size());
}

Key32 random_key() noexcept {
  Key32 key;
  fill_randomly(key);
  return key;
}

KeyPair new_key_pair() noexcept {
  KeyPair pair;
  fill_randomly(pair.secret);
  crypto_scalarmult_base(raw(pair.public_key.data()), raw(pair.secret.data()));
  return pair;
}

KeyPair key_pair_of(const Key32& secret) noexcept {
  prepare_sodium();
  KeyPair pair;
  pair.secret = secret;
  crypto_scalarmult_base(raw(pair.public_key.data()), raw(pair.secret.data()));
  return pair;
}

std::optional<Key32> shared_secret(const KeyPair& own, const Key32& public_key) noexcept {
  prepare_sodium();
  std::optional<Key32> shared(std::in_place);
  // libsodium refuses a result of all zeros, which is what the public keys of small order give with any secret.
  if (crypto_scalarmult(raw(shared->data()), raw(own.secret.data()), raw(public_key.data())) != 0) return std::nullopt;
  return shared;
}

SealKey::SealKey(Suite suite, const Key32& key) noexcept : suite_(suite) {
  static_assert(sizeof(crypto_aead_aes256gcm_state) <= kStateBytes && alignof(crypto_aead_aes256gcm_state) <= 16);
  if (!is_available(suite)) std::abort();  // a bug of the caller, who chooses a suite by is_available
  if (suite == Suite::kAesGcm)
    crypto_aead_aes256gcm_beforenm(reinterpret_cast<crypto_aead_aes256gcm_state*>(state_.data()), raw(key.data()));
  else
    std::memcpy(state_.data(), key.data(), key.size());
}

void SealKey::seal(std::uint64_t counter, std::span<const std::byte> associated, std::span<const std::byte> plain,
                   std::span<std::byte> out) const noexcept {
  if (out.size() != plain.size() + kTagBytes) std::abort();  // a bug of the caller: bytes would be lost or overrun
  const Nonce nonce = nonce_of(suite_, counter);
  if (suite_ == Suite::kAesGcm)
    crypto_aead_aes256gcm_encrypt_afternm(raw(out.data()), nullptr, raw(plain.data()), plain.size(),
                                          raw(associated.data()), associated.size(), nullptr, raw(nonce.data()),
                                          aes_state(state_.data()));
  else
    crypto_aead_chacha20poly1305_ietf_encrypt(raw(out.data()), nullptr, raw(plain.data()), plain.size(),
                                              raw(associated.data()), associated.size(), nullptr, raw(nonce.data()),
                                              raw(state_.data()));
}

bool SealKey::open(std::uint64_t counter, std::span<const std::byte> associated, std::span<const std::byte> sealed,
                   std::span<std::byte> out) const noexcept {
  if (sealed.size() < kTagBytes || out.size() != sealed.size() - kTagBytes) return false;
  const Nonce nonce = nonce_of(suite_, counter);
  if (suite_ == Suite::kAesGcm)
    return crypto_aead_aes256gcm_decrypt_afternm(raw(out.data()), nullptr, nullptr, raw(sealed.data()), sealed.size(),
                                                 raw(associated.data()), associated.size(), raw(nonce.data()),
                                                 aes_state(state_.data())) == 0;
  return crypto_aead_chacha20poly1305_ietf_decrypt(raw(out.data()), nullptr, nullptr, raw(sealed.data()), sealed.size(),
                                                   raw(associated.data()), associated.size(), raw(nonce.data()),
                                                   raw(state_.data())) == 0;
}

}  // namespace farfeel::transport
