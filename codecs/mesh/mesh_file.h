// Triangle meshes from anybody's files: OBJ, OFF, PLY, STL, glTF (with and without Draco). Positions and triangles,
// and colours of vertices, where PLY, OBJ and glTF have them.
//
// What comes back is what the file says, polygons cut into triangles (polygon.h): it may be open, doubled, inside out.
// slave_sim/bake repairs that or refuses it. There is a triangle at least, and every index is in range; coordinates may
// be anything, NaN included.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/mesh/colours.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

struct MeshError {
  std::string message;  ///< what was tried, what was wrong, what to do
};
struct MeshInFile : ColouredMesh {
  std::vector<std::string> notes;  ///< what was passed over or contradicts itself, in words; mostly empty
};
using MeshResult = tl::expected<MeshInFile, MeshError>;

/// Bytes may be hostile: sizes and indices are checked before anything is allocated for them. A byte order mark is
/// passed over. Refused, by name: UTF-16, point clouds, polygons that cross themselves.
[[nodiscard]] MeshResult read_obj(std::span<const std::byte>);
[[nodiscard]] MeshResult read_off(std::span<const std::byte>);
[[nodiscard]] MeshResult read_ply(std::span<const std::byte>);  ///< ascii, binary little- and big-endian; strips
[[nodiscard]] MeshResult read_stl(std::span<const std::byte>);  ///< ascii and binary; corners are not joined yet

/// .glb, or .gltf with everything inside (base64 buffers) or beside it in `folder`; an empty folder: nothing beside it.
/// All triangle primitives of the default scene, placed by their nodes.
[[nodiscard]] MeshResult read_gltf(std::span<const std::byte>, const std::filesystem::path& folder = {});

/// By the file's suffix.
[[nodiscard]] MeshResult read_mesh_file(const std::filesystem::path&);

// For the readers.

/// The text without its byte order mark; refused if it is not in UTF-8 or ASCII.
[[nodiscard]] tl::expected<std::string_view, MeshError> plain_text(std::span<const std::byte>);
/// Refused if it has no triangles: it is empty, or a point cloud.
[[nodiscard]] MeshResult with_faces(MeshInFile);

}  // namespace farfeel::codecs
