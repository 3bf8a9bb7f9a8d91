// An object of the bulk lane: immutable bytes, named by their hash.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace farfeel::transport {

/// BLAKE2b-256 of the bytes.
using ObjectHash = std::array<std::byte, 32>;
[[nodiscard]] ObjectHash hash_of(std::span<const std::byte> bytes);

/// Specification constant: a receiver refuses anything larger before it allocates.
inline constexpr std::uint64_t kMaxObjectBytes = 64ull << 20;

struct Object {
  ObjectHash hash;
  std::vector<std::byte> bytes;
};
[[nodiscard]] std::shared_ptr<const Object> make_object(std::vector<std::byte> bytes);

}  // namespace farfeel::transport
