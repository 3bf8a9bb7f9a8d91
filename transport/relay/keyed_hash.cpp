#include "transport/relay/keyed_hash.h"

#include <sodium.h>

#include <cstdlib>

namespace farfeel::transport {
namespace {

const unsigned char* raw(const std::byte* bytes) {
  return reinterpret_cast<const unsigned char*>(bytes);
}

void hash_into(std::span<std::byte> out, const RelayKey& key, std::span<const std::byte> bytes) noexcept {
  // It fails on sizes that it does not know alone, and these are constants.
  (void)crypto_generichash(reinterpret_cast<unsigned char*>(out.data()), out.size(), raw(bytes.data()), bytes.size(),
                           raw(key.data()), key.size());
}

}  // namespace

Mac keyed_hash(const RelayKey& key, std::span<const std::byte> bytes) noexcept {
  Mac mac;
  hash_into(mac, key, bytes);
  return mac;
}

RelayKey derived_key(const RelayKey& key, std::span<const std::byte> bytes) noexcept {
  RelayKey derived;
  hash_into(derived, key, bytes);
  return derived;
}

bool is_equal(const Mac& a, const Mac& b) noexcept {
  return sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

RelayKey random_relay_key() {
  if (sodium_init() < 0) std::abort();  // the system has no random numbers: nothing can be secret
  RelayKey key;
  randombytes_buf(key.data(), key.size());
  return key;
}

}  // namespace farfeel::transport
