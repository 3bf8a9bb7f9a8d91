// Meshes as bytes between a process that asks for them to be decoded and one that decodes them. Neither believes the
// other: every length is bounded before anything is allocated, and a mesh is looked at before it is used.
//
// Little-endian. Coded: u32 meshes, then each: u32 triangles claimed, u32 bytes, a Draco bitstream.
// Decoded: for each mesh u32 vertices, u32 triangles, u32 colours, as many as vertices or none; 3 f32 a vertex [m], 3
// u32 a triangle, 3 u8 a colour. Nothing after the last.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "codecs/mesh/draco_mesh.h"

namespace farfeel::codecs {

[[nodiscard]] std::vector<std::byte> write_coded(std::span<const CodedMesh>);
/// The meshes, which point into the bytes; nothing where these are not what write_coded makes of meshes without a
/// fault.
[[nodiscard]] std::optional<std::vector<CodedMesh>> read_coded(std::span<const std::byte>);

/// Positions become f32, which is what Draco's are.
[[nodiscard]] std::vector<std::byte> write_decoded(std::span<const ColouredMesh>);
/// Fails where these are not as many meshes as were coded, or one has more triangles than were claimed, or a fault.
[[nodiscard]] DecodedMeshes read_decoded(std::span<const std::byte>, std::span<const CodedMesh>);
/// Of the bytes that read_decoded takes.
[[nodiscard]] std::size_t most_decoded_bytes(std::span<const CodedMesh>);

}  // namespace farfeel::codecs
