// Triangle meshes <-> Draco bitstreams: positions and connectivity only, edgebreaker, 14 bits a coordinate.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

inline constexpr int kPositionBits = 14;

/// Fails with a reason on an empty mesh, an index out of range, or a coordinate that is not finite or beyond 10 km: one
/// outlier would spend the whole grid. Vertices come back reordered; degenerate triangles and unused vertices do not.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> write_draco(const geometry::TriangleMesh&);

/// For bytes from anybody. Only what write_draco() makes is read; see draco_bounds.h for what is checked before Draco
/// allocates. Indices and coordinates are checked afterwards.
[[nodiscard]] tl::expected<geometry::TriangleMesh, std::string> read_draco(std::span<const std::byte> bitstream,
                                                                           std::uint32_t max_triangles);

}  // namespace farfeel::codecs
