// Triangle meshes as Draco bitstreams, positions only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

struct DracoMesh {
  std::vector<std::byte> bytes;
  geometry::TriangleMesh decoded;  ///< what a decoder gets: vertices and triangles reordered, positions quantised
  std::uint32_t position_id = 0;   ///< Draco's unique id of the position attribute
};

/// Edgebreaker. Largest error about 0.85 * (longest side of the box) / 2^position_bits. Fails on an empty mesh and on
/// coordinates that are not finite.
[[nodiscard]] tl::expected<DracoMesh, std::string> draco_encoded(const geometry::TriangleMesh&, int position_bits = 14);

/// Bytes may be hostile: indices and coordinates are checked after decoding. position_id < 0: the first position
/// attribute.
[[nodiscard]] tl::expected<geometry::TriangleMesh, std::string> draco_decoded(std::span<const std::byte>,
                                                                              int position_id = -1);

}  // namespace farfeel::codecs
