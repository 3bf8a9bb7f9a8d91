// Height tiles as bytes: what a texture, an edit and a cache send. One codec for all three.
//
// A part is a band of a tile's rows, complete in itself:
//   u8 format (1)  u8 coding (0 raw, 1 predicted)  u8 first_row  u8 rows  u32 tile  u32 version  payload to the end
// little-endian. The payload is the rows' coefficients, raw (2 bytes each) or, whichever is shorter, predicted: each
// coefficient's difference from what its left, upper and upper left neighbours predict (MED, Weinberger, Seroussi &
// Sapiro 2000), zigzag, all high bytes before all low ones, one zstd frame.
//
// Split rule: a tile travels as one part if that fits kMostPartBytes; else as two, rows 0-15 and rows 16-31. A raw half
// is 1,036 bytes, so that every part fits whatever its contents.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/height_tile.h"

namespace farfeel::codecs {

inline constexpr std::size_t kTilePartHeaderBytes = 12;
inline constexpr std::size_t kMostPartBytes = 1150;  ///< leaves 50 bytes of a 1,200-byte datagram to whoever carries it

struct TilePart {
  std::uint32_t tile = 0;  ///< index into HapticSurface::tiles
  std::uint32_t version = 0;
  std::uint32_t first_row = 0, rows = 0;    ///< 0, 16 or 32 rows from 0 or 16
  std::vector<std::uint16_t> coefficients;  ///< rows * kTileSide
};

/// One part or two, each <= kMostPartBytes.
[[nodiscard]] std::vector<std::vector<std::byte>> encoded_tile(std::uint32_t tile, const geometry::HeightTile&);

/// Bytes may be hostile: exact lengths, known values, output bounded before anything is unpacked.
[[nodiscard]] tl::expected<TilePart, std::string> decoded_tile_part(std::span<const std::byte>);

/// Puts a tile together from parts that may come in any order, doubled, or of several versions: the newest wins.
class TileAssembly {
 public:
  /// True if the tile is now complete in a version it did not have before; get it with tile().
  bool add(const TilePart&);
  [[nodiscard]] const geometry::HeightTile& tile() const { return tile_; }

 private:
  geometry::HeightTile growing_, tile_;
  std::uint32_t rows_present_ = 0;  ///< of growing_: bit 0 upper half, bit 1 lower half
  bool has_tile_ = false;
};

}  // namespace farfeel::codecs
