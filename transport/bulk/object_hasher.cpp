#include "transport/bulk/object_hasher.h"

#include <sodium.h>

#include <cstdlib>

namespace farfeel::transport {
namespace {

crypto_generichash_state* state_in(std::byte* bytes) {
  static_assert(sizeof(crypto_generichash_state) <= 384 && alignof(crypto_generichash_state) <= 64);
  return reinterpret_cast<crypto_generichash_state*>(bytes);
}

}  // namespace

ObjectHasher::ObjectHasher() {
  if (sodium_init() < 0) std::abort();  // chooses the fastest code for this processor; may be asked any number of times
  (void)crypto_generichash_init(state_in(state_), nullptr, 0, std::tuple_size_v<ObjectHash>);
}

void ObjectHasher::add(std::span<const std::byte> bytes) {
  (void)crypto_generichash_update(state_in(state_), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

ObjectHash ObjectHasher::finish() {
  ObjectHash hash;
  (void)crypto_generichash_final(state_in(state_), reinterpret_cast<unsigned char*>(hash.data()), hash.size());
  return hash;
}

}  // namespace farfeel::transport
