// Triangle meshes from anybody's files: OBJ, PLY, STL, glTF (with and without Draco). Positions and triangles only.
//
// What comes back is what the file says, polygons cut into fans: it may be open, doubled, inside out. slave_sim/bake
// repairs that or refuses it. Every index is in range; coordinates may be anything, NaN included.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

struct MeshError {
  std::string message;  ///< what was tried, what was wrong, what to do
};
using MeshResult = tl::expected<geometry::TriangleMesh, MeshError>;

/// Bytes may be hostile: sizes and indices are checked before anything is allocated for them.
[[nodiscard]] MeshResult read_obj(std::span<const std::byte>);
[[nodiscard]] MeshResult read_ply(std::span<const std::byte>);  ///< ascii, binary little- and big-endian
[[nodiscard]] MeshResult read_stl(std::span<const std::byte>);  ///< ascii and binary; corners are not joined yet

/// .glb, or .gltf with everything inside (base64 buffers) or beside it in `folder`; an empty folder: nothing beside it.
/// All triangle primitives of the default scene, placed by their nodes.
[[nodiscard]] MeshResult read_gltf(std::span<const std::byte>, const std::filesystem::path& folder = {});

/// By the file's suffix.
[[nodiscard]] MeshResult read_mesh_file(const std::filesystem::path&);

}  // namespace farfeel::codecs
