// What proves things on a relay: keyed BLAKE2b, and keys.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace farfeel::transport {

using RelayKey = std::array<std::byte, 32>;
using Mac = std::array<std::byte, 16>;

/// BLAKE2b of `bytes` under `key`: 16 or 32 bytes.
[[nodiscard]] Mac keyed_hash(const RelayKey& key, std::span<const std::byte> bytes) noexcept;
[[nodiscard]] RelayKey derived_key(const RelayKey& key, std::span<const std::byte> bytes) noexcept;
/// In constant time.
[[nodiscard]] bool is_equal(const Mac&, const Mac&) noexcept;
[[nodiscard]] RelayKey random_relay_key();

}  // namespace farfeel::transport
