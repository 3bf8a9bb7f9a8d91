#include "codecs/mesh/draco_any.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>

namespace farfeel::codecs {
namespace {

// Implementation constant: more than Draco's best ratio on a mesh that somebody means.
constexpr std::uint64_t kMostTrianglesPerByte = 256;

/// Two counts follow a mesh's 11-byte header: for edgebreaker after one byte for the kind of traversal, vertices and
/// faces; for sequential coding faces and points. Draco bitstream specification, sections 5 to 7.
bool claims_too_much(std::span<const std::byte> bytes) {
  constexpr std::size_t kHeaderBytes = 11, kMethodAt = 8;
  if (bytes.size() < kHeaderBytes + 1) return true;
  std::size_t at = kHeaderBytes + (bytes[kMethodAt] == std::byte{1} ? 1 : 0);
  for (int i = 0; i < 2; ++i) {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      if (at >= bytes.size()) return true;
      const auto byte = static_cast<std::uint64_t>(bytes[at++]);
      value |= (byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) break;
    }
    if (value > kMostTrianglesPerByte * bytes.size()) return true;
  }
  return false;
}

}  // namespace

tl::expected<geometry::TriangleMesh, std::string> draco_positions(std::span<const std::byte> bytes,
                                                                  std::uint32_t position_id) {
  constexpr std::array kBegin{'D', 'R', 'A', 'C', 'O', '\2', '\2', '\1'};
  if (bytes.size() < 11 || std::memcmp(bytes.data(), kBegin.data(), kBegin.size()) != 0) {
    return tl::unexpected(std::string("a Draco primitive is not a mesh of bitstream 2.2"));
  }
  if (bytes[9] != std::byte{0} || bytes[10] != std::byte{0}) {
    return tl::unexpected(std::string("a Draco primitive carries metadata; export without it"));
  }
  if (claims_too_much(bytes))
    return tl::unexpected(std::string("a Draco primitive claims more triangles than it has bytes for"));
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return tl::unexpected("Draco: " + decoded.status().error_msg_string());
    const std::unique_ptr<draco::Mesh> in = std::move(decoded).value();
    const draco::PointAttribute* position = in->GetAttributeByUniqueId(position_id);
    if (position == nullptr || position->num_components() != 3) {
      return tl::unexpected(std::string("a Draco primitive has no positions under the id it gives"));
    }
    geometry::TriangleMesh mesh;
    for (draco::PointIndex i(0); i < in->num_points(); ++i) {
      const draco::AttributeValueIndex value = position->mapped_index(i);
      std::array<float, 3> p{};
      if (value.value() >= position->size() || !position->ConvertValue<float, 3>(value, p.data())) {
        return tl::unexpected(std::string("a Draco primitive has a vertex without a position"));
      }
      mesh.positions_O.emplace_back(p[0], p[1], p[2]);
    }
    for (draco::FaceIndex f(0); f < in->num_faces(); ++f) {
      const draco::Mesh::Face& face = in->face(f);
      const geometry::Triangle t{face[0].value(), face[1].value(), face[2].value()};
      if (std::max({t[0], t[1], t[2]}) >= mesh.positions_O.size()) {
        return tl::unexpected(std::string("a Draco primitive has an index out of range"));
      }
      mesh.triangles.push_back(t);
    }
    return mesh;
  } catch (const std::exception& e) {
    return tl::unexpected(std::string("Draco: ") + e.what());
  }
}

}  // namespace farfeel::codecs
