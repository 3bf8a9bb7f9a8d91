// The bytes, little-endian: u32 "FFFA", u16 version 1, u16 0, u32 length of the outline, the outline, then the parts of
// every tile of every body (codecs/tile/tile_codec.h), in the bodies' order: u16 length, part.
#include "codecs/recording/felt_asset.h"

#include <algorithm>

#include "codecs/felt/felt_outline.h"
#include "codecs/tile/tile_codec.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint32_t kMagic = 0x4146'4646;  // "FFFA"
constexpr std::uint16_t kVersion = 1;

tl::unexpected<std::string> wrong(const std::string& why) {
  return tl::unexpected("the felt asset: " + why);
}

template <typename T>
void put(std::vector<std::byte>& to, T value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// Whether the next parts are this tile's.
bool read_tile(transport::ByteReader& r, std::uint32_t index, geometry::HeightTile& tile) {
  TileAssembly assembly;
  for (int parts = 0; parts < 2; ++parts) {
    const auto part = decoded_tile_part(r.bytes(r.u16()));
    if (!part || part->tile != index) return false;
    if (!assembly.add(*part)) continue;
    tile = assembly.tile();
    return true;
  }
  return false;
}

}  // namespace

tl::expected<std::vector<std::byte>, std::string> write_felt_asset(
    std::span<const contact_service::TouchableObject> bodies, const contact_service::ContactOptions& options) {
  const auto outline = write_felt_outline(bodies, options);
  if (!outline) return tl::unexpected(outline.error());
  std::vector<std::byte> bytes;
  put(bytes, kMagic);
  put(bytes, kVersion);
  put(bytes, std::uint16_t{0});
  put(bytes, static_cast<std::uint32_t>(outline->size()));
  bytes.insert(bytes.end(), outline->begin(), outline->end());
  for (const contact_service::TouchableObject& body : bodies) {
    for (std::uint32_t i = 0; i < body.felt->tiles.size(); ++i) {
      for (const std::vector<std::byte>& part : encoded_tile(i, body.felt->tiles[i], kExactly)) {
        put(bytes, static_cast<std::uint16_t>(part.size()));
        bytes.insert(bytes.end(), part.begin(), part.end());
      }
    }
  }
  return bytes;
}

tl::expected<FeltAsset, std::string> read_felt_asset(std::span<const std::byte> bytes) {
  transport::ByteReader r(bytes);
  if (r.u32() != kMagic || r.u16() != kVersion || r.u16() != 0) return wrong("it does not begin as one of version 1");
  const auto outline = r.bytes(r.u32());
  auto scene = read_felt_outline(outline);
  if (!scene) return tl::unexpected(scene.error());
  for (contact_service::FeltBody& body : scene->bodies) {
    for (std::uint32_t i = 0; i < body.surface.tiles.size(); ++i)
      if (!read_tile(r, i, body.surface.tiles[i])) return wrong("its heights are none");
  }
  if (!r.is_at_end()) return wrong("its length does not fit its contents");
  return FeltAsset{{outline.begin(), outline.end()}, *std::move(scene)};
}

}  // namespace farfeel::codecs
