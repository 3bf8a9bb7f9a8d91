// Height tiles on the bulk lane: one part of a tile down, the names of whole ones back. PROTOCOL.md has the tables.
//
// A part is what codecs/tile makes of a tile. Every message is a statement that may be said again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farfeel::codecs {

inline constexpr std::size_t kTileHeadBytes = 4;

struct TileMessage {
  std::uint32_t surface = 0;        ///< 0 is the tool, k + 1 scene object k
  std::span<const std::byte> part;  ///< not empty; read: points into the payload
};

/// One tile that is whole at the master, in this version.
struct TileName {
  std::uint32_t surface = 0, tile = 0, version = 0;
};

struct TileAcknowledge {
  static constexpr std::size_t kMost = 96;
  std::uint32_t count = 0;  ///< <= kMost; 0: none yet, but send them
  std::array<TileName, kMost> tiles{};
};

/// Each returns the payload's size, or 0 if it does not fit.
[[nodiscard]] std::size_t write(const TileMessage&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::size_t write(const TileAcknowledge&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::optional<TileMessage> read_tile_message(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<TileAcknowledge> read_tile_acknowledge(std::span<const std::byte> payload) noexcept;

}  // namespace farfeel::codecs
