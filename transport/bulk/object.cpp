#include "transport/bulk/object.h"

#include <sodium.h>

#include <cstdlib>

namespace farfeel::transport {
namespace {

// Chooses the fastest code for this processor; safe to ask any number of times from any thread.
void prepare_sodium() {
  if (sodium_init() < 0) std::abort();  // no source of random numbers: nothing may be built on that
}

}  // namespace

ObjectHash hash_of(std::span<const std::byte> bytes) {
  prepare_sodium();
  ObjectHash hash;
  crypto_generichash(reinterpret_cast<unsigned char*>(hash.data()), hash.size(),
                     reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), nullptr, 0);
  return hash;
}

std::shared_ptr<const Object> make_object(std::vector<std::byte> bytes) {
  const ObjectHash hash = hash_of(bytes);
  return std::make_shared<const Object>(Object{hash, std::move(bytes)});
}

}  // namespace farfeel::transport
