// tinygltf, for documents that have passed our own checks. For sources only: it brings tinygltf's header with it.
#pragma once

// Images are never decoded, and Draco only by draco_any.h, which bounds what a bitstream may claim.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

#include "codecs/mesh/gltf_structure.h"

namespace farfeel::codecs {

/// The document with its buffers' bytes, each exactly as long as it says, and packed views unpacked. Reads files in
/// `folder` only.
[[nodiscard]] tl::expected<tinygltf::Model, std::string> loaded_gltf(const CheckedGltf&,
                                                                     const std::filesystem::path& folder);

}  // namespace farfeel::codecs
