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

/// Specification constants: a receiver refuses anything larger before it allocates.
inline constexpr std::uint64_t kMaxObjectBytes = 64ull << 20;
inline constexpr std::size_t kChunkBytes = 1'150;  ///< every chunk but the last
[[nodiscard]] constexpr std::uint32_t chunks_of(std::uint64_t size) {
  return static_cast<std::uint32_t>((size + kChunkBytes - 1) / kChunkBytes);
}

struct Object {
  ObjectHash hash;
  std::vector<std::byte> bytes;
};
[[nodiscard]] std::shared_ptr<const Object> make_object(std::vector<std::byte> bytes);

/// What a process calls itself, so that its peer notices a restart: random, never 0.
[[nodiscard]] std::uint64_t random_identity();

}  // namespace farfeel::transport
