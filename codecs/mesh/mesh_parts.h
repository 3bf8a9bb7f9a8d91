// A file of several parts, part by part: a glTF's nodes with meshes, an OBJ's objects (its groups, where it has none).
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "codecs/mesh/mesh_file.h"

namespace farfeel::codecs {

/// Where one part stands: R, then p, take its shape's coordinates to the file's. What a node scales, shears or mirrors
/// is in the shape.
struct MeshPart {
  std::string name;  ///< as the file has it: any text, also empty, also twice
  std::size_t shape = 0;
  glm::dquat R{1, 0, 0, 0};
  glm::dvec3 p{0};  ///< in the file's unit
};
/// Parts that show the same mesh in the same size have one shape.
struct MeshParts {
  std::vector<MeshInFile> shapes;  ///< each with a triangle at least; in the file's unit
  std::vector<MeshPart> parts;
};

inline constexpr std::size_t kMostParts = 256;  ///< as many as a scene has objects

/// Refused as read_mesh_file() refuses; and files of other formats, which have no parts, or of too many.
[[nodiscard]] tl::expected<MeshParts, MeshError> read_mesh_parts(const std::filesystem::path&);

/// What to say of more than that.
[[nodiscard]] std::string too_many_parts();

// For the readers: bytes may be hostile, as those of mesh_file.h.
[[nodiscard]] tl::expected<MeshParts, MeshError> read_gltf_parts(std::span<const std::byte>,
                                                                 const std::filesystem::path& folder = {});
[[nodiscard]] tl::expected<MeshParts, MeshError> read_obj_parts(std::span<const std::byte>);

}  // namespace farfeel::codecs
