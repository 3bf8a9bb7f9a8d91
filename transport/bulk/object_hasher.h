// BLAKE2b-256 of bytes that come one after another, so that a large object's hash is never computed all at once.
#pragma once

#include <cstddef>
#include <span>

#include "transport/bulk/object.h"

namespace farfeel::transport {

class ObjectHasher {
 public:
  ObjectHasher();
  void add(std::span<const std::byte> bytes);
  /// Of everything added. Nothing may be added after it.
  [[nodiscard]] ObjectHash finish();

 private:
  alignas(64) std::byte state_[384];
};

}  // namespace farfeel::transport
