// Height tiles as bytes: what a texture, an edit and a cache send. One codec for all three.
//
// A part is a band of a tile's rows, complete in itself:
//   u8 form  u8 band (0: all rows, 1: rows 0-15, 2: rows 16-31)  u32 tile  u32 version  payload to the end
// little-endian. The payload, by form, of which an encoder takes the shortest:
//   2 raw     2 bytes a coefficient
//   3 stepped u16 within, then row by row: from what the left, upper and upper left neighbours as read predict (MED,
//             Weinberger, Seroussi & Sapiro 2000), so many steps of 2 within + 1. Near-lossless as in JPEG-LS, and
//             lossless where within is 0; any relief
//   4 smooth  all rows alone: u8 step, u8 most degree, then the spectrum (smooth_basis.h) in units of 2^(step / 8 - 2),
//             diagonal by diagonal up to that degree. For relief that is smooth for the texels' size
//   5 same    all rows, nothing: the tile is as the receiver has told that it holds it, from this version on
// The numbers of forms 3 and 4 are told as number_coder.h says.
//
// Split rule: a tile travels as one part if that fits kMostPartBytes; else as two, rows 0-15 and rows 16-31. A raw half
// is 1,034 bytes, so that every part fits whatever its contents.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::codecs {

inline constexpr std::size_t kTilePartHeaderBytes = 10;
inline constexpr std::size_t kMostPartBytes = 1150;  ///< leaves 50 bytes of a 1,200-byte datagram to whoever carries it

/// How near what is read is to what was written, in coefficients' steps. A height is a mean of coefficients with
/// weights that are not negative, a slope one of neighbours' differences over a texel: so they are as near.
struct Nearness {
  std::uint16_t coefficients = 0;  ///< each is off by at most so much
  std::uint16_t differences = 0;   ///< and so is, by this, the difference of two neighbours in a row or a column
};
inline constexpr Nearness kExactly{};

/// What is felt over a link is this near to the surface: a twentieth of the soft maximum's width, and what turns a
/// force by a thousandth part or two; slopes of texels finer than 0.1 mm as if they were that.
inline constexpr double kHeightsWithin_m = 0.5e-6, kSlopesWithin = 0.0015;
[[nodiscard]] Nearness nearness(const geometry::HapticSurface&, double heights_within_m = kHeightsWithin_m,
                                double slopes_within = kSlopesWithin) noexcept;

/// Exactly is often hardly longer than near enough, and what is finer is felt: a tile of so many bytes in all is worth
/// it. At 0.1 m/s a contact crosses up to 320 tiles a second (those of a scan): 130 kB/s with their messages' heads.
inline constexpr std::size_t kWorthBytes = 390;

struct TilePart {
  std::uint32_t tile = 0;  ///< index into HapticSurface::tiles
  std::uint32_t version = 0;
  std::uint32_t first_row = 0, rows = 0;  ///< 0, 16 or 32 rows from 0 or 16
  bool is_same = false;                   ///< no coefficients: the receiver holds them
  std::array<std::uint16_t, std::size_t{geometry::kTileSide} * geometry::kTileSide> coefficients{};  ///< rows of them
};

/// One part or two, each <= kMostPartBytes: as short as the nearness lets them be, but as much finer, at best exact, as
/// worth_bytes in all allow.
[[nodiscard]] std::vector<std::vector<std::byte>> encoded_tile(std::uint32_t tile, const geometry::HeightTile&,
                                                               const Nearness&, std::size_t worth_bytes = 0);

/// The part that says: as you hold it.
[[nodiscard]] std::vector<std::byte> encoded_same(std::uint32_t tile, std::uint32_t version);

/// Of the coefficients, FNV-1a over their little-endian bytes, 64 bits folded to 32: by it a receiver names what it
/// holds. Not 0, which says that it holds nothing. Two tiles that differ share it once in 2^32.
[[nodiscard]] std::uint32_t hash_of(const geometry::HeightTile&);

/// Bytes may be hostile: exact lengths, known values, no more work than a tile's.
[[nodiscard]] tl::expected<TilePart, std::string> decoded_tile_part(std::span<const std::byte>);

/// Puts a tile together from parts that may come in any order, doubled, or of several versions: the newest wins.
class TileAssembly {
 public:
  /// True if the tile is now complete in a version it did not have before; get it with tile(). Not of is_same.
  bool add(const TilePart&);
  [[nodiscard]] const geometry::HeightTile& tile() const { return tile_; }

 private:
  geometry::HeightTile growing_, tile_;
  std::uint32_t rows_present_ = 0;  ///< of growing_: bit 0 upper half, bit 1 lower half
  bool has_tile_ = false;
};

}  // namespace farfeel::codecs
