// Height tiles on the bulk lane: one part of a tile down, the wish for them and what is held of them up. PROTOCOL.md
// has the tables.
//
// A part is what codecs/tile makes of a tile. Each message may come twice and changes nothing then.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farfeel::codecs {

inline constexpr std::size_t kTileHeadBytes = 4;
inline constexpr std::size_t kTileRequestBytes = 4;

struct TileMessage {
  std::uint32_t surface = 0;        ///< 0 is the tool, k + 1 scene object k
  std::span<const std::byte> part;  ///< not empty; read: points into the payload
};

/// "Send height tiles." Said again and again while they are wanted.
struct TileRequest {
  std::uint32_t round = 0;  ///< from 1; a greater one: nothing that was sent before is here any more
};

/// "These tiles of a surface I hold, from a session before this one." Told once, before the first request; what of it
/// is lost is sent again as if it were not held.
struct TilesHeld {
  static constexpr std::size_t kMost = 280;
  std::uint32_t surface = 0;
  std::uint32_t first = 0;                    ///< tile
  std::uint32_t count = 0;                    ///< of tiles from there on that are told of, 1 to kMost
  std::array<std::uint32_t, kMost> hashes{};  ///< codecs::hash_of; 0: not held
};
inline constexpr std::size_t kMostTilesHeldBytes = 8 + 4 * TilesHeld::kMost;

/// Each returns the payload's size, or 0 if it does not fit.
[[nodiscard]] std::size_t write(const TileMessage&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::size_t write(const TileRequest&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::size_t write(const TilesHeld&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::optional<TileMessage> read_tile_message(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<TileRequest> read_tile_request(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<TilesHeld> read_tiles_held(std::span<const std::byte> payload) noexcept;

}  // namespace farfeel::codecs
