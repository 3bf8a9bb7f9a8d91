// What stands between anybody's glTF bytes and tinygltf: every length, index, offset and name that a reader of
// triangles follows is checked here, and only what was checked is handed on.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "codecs/mesh/meshopt_view.h"

namespace farfeel::codecs {

inline constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

/// A document with nothing in it but buffers, views, accessors, triangle primitives, skins of nodes with meshes, nodes
/// and scenes, in which
///   every index is in range, every view lies within its buffer's byteLength,
///   positions are VEC3 of floats or small integers, colours VEC3 or VEC4 of floats or shares, indices unsigned
///   SCALARs, joints and weights VEC4, a skin's matrices as many MAT4 as it has joints, all within their views, sparse
///   ones too, a Draco primitive has no attributes and no indices but those of its extension, buffers are the binary
///   chunk, base64, or a file in the document's folder (only if it has one), see gltf_uri.h, packed views are told
///   apart, all together no more bytes than there are; in the document they are the packed bytes.
/// Refused: what it requires and is not followed, by name. Not checked: values inside buffers; that nodes form a tree;
/// that a buffer has as many bytes as it says.
struct CheckedGltf {
  nlohmann::json document;
  std::vector<std::filesystem::path> files;  ///< in the folder; the document names them "file 0", "file 1", ...
  std::vector<std::pair<std::size_t, MeshoptView>> packed;  ///< which views are, and how
  bool is_binary = false;
  std::span<const std::byte> binary;  ///< a view into what was given
};

/// Bytes may be hostile. An empty folder: nothing may stand beside the document.
[[nodiscard]] tl::expected<CheckedGltf, std::string> checked_gltf(std::span<const std::byte> bytes,
                                                                  const std::filesystem::path& folder);

}  // namespace farfeel::codecs
