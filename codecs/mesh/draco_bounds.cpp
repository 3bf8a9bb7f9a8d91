// Source: the Draco bitstream specification, https://google.github.io/draco/spec/, sections 5 and 6.

#include "codecs/mesh/draco_bounds.h"

#include <cstring>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;

constexpr std::uint8_t kTriangularMesh = 1, kEdgebreaker = 1, kStandardTraversal = 0;
constexpr std::uint8_t kPosition = 0, kColour = 2, kFloat32 = 9, kByte = 2, kThree = 3;

/// Seven bits a byte, least significant first. Longer than 32 bits comes back as the largest number there is.
std::uint32_t varint(ByteReader& r) noexcept {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 70; shift += 7) {
    const std::uint8_t byte = r.u8();
    if (shift < 63) value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    if ((byte & 0x80) == 0) return value > 0xFFFF'FFFF ? 0xFFFF'FFFF : static_cast<std::uint32_t>(value);
  }
  return 0xFFFF'FFFF;
}

/// Skips the events where the traversal meets itself: two numbers each, then a bit each.
void skip_topology_splits(ByteReader& r) noexcept {
  const std::uint32_t splits = varint(r);
  for (std::uint32_t i = 0; i < splits && r.ok(); ++i) {
    (void)varint(r);
    (void)varint(r);
  }
  (void)r.bytes(splits / 8 + (splits % 8 != 0 ? 1 : 0));
}

}  // namespace

std::optional<DracoBounds> draco_bounds(std::span<const std::byte> bitstream) noexcept {
  ByteReader r(bitstream);
  const auto magic = r.bytes(5);
  if (!r.ok() || std::memcmp(magic.data(), "DRACO", 5) != 0) return std::nullopt;
  const std::uint8_t major = r.u8(), minor = r.u8(), geometry = r.u8(), method = r.u8();
  const std::uint16_t flags = r.u16();
  const std::uint8_t traversal = r.u8();
  if (major != 2 || minor != 2 || geometry != kTriangularMesh || method != kEdgebreaker || flags != 0 ||
      traversal != kStandardTraversal)
    return std::nullopt;

  DracoBounds bounds;
  bounds.vertices = varint(r);
  bounds.triangles = varint(r);
  const std::uint8_t attribute_connectivities = r.u8();
  const std::uint32_t symbols = varint(r), split_symbols = varint(r);
  skip_topology_splits(r);
  // A symbol takes a bit at least. Every triangle has one, but the first of a component may have none.
  const std::uint32_t symbol_bytes = varint(r);
  (void)r.bytes(symbol_bytes);
  (void)r.u8();  // start faces: a probability, then coded bits
  (void)r.bytes(varint(r));
  if (!r.ok() || attribute_connectivities != 0 || bounds.triangles == 0) return std::nullopt;
  if (symbols > 8ull * symbol_bytes || split_symbols > symbols || bounds.triangles > 2ull * symbols + 1 ||
      bounds.vertices > 3ull * bounds.triangles)
    return std::nullopt;
  bounds.vertices += split_symbols;

  const std::uint8_t attribute_decoders = r.u8();
  (void)r.bytes(3);  // which connectivity, element type, traversal method
  const std::uint32_t attributes = varint(r);
  if (attribute_decoders != 1 || attributes < 1 || attributes > 2) return std::nullopt;
  bounds.has_colours = attributes == 2;
  for (std::uint32_t i = 0; i < attributes; ++i) {
    const std::uint8_t type = r.u8(), component_type = r.u8(), components = r.u8();
    (void)r.u8();     // normalised
    (void)varint(r);  // its id
    if (type != (i == 0 ? kPosition : kColour) || component_type != (i == 0 ? kFloat32 : kByte) || components != kThree)
      return std::nullopt;
  }
  if (!r.ok()) return std::nullopt;
  return bounds;
}

}  // namespace farfeel::codecs
