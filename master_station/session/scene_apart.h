// The scene's meshes, decoded by a process of its own: Draco is not ours, and what it is fed comes from the slave. A
// bitstream that makes it crash, loop or ask for memory ends that process, and the master says why there is no scene.
#pragma once

#include <span>

#include "codecs/mesh/draco_mesh.h"
#include "transport/confine/apart.h"

namespace farfeel::master_station {

/// Four million triangles, as many as a scene may have, take 0.2 GB and 3 s as sheets, and four times the memory where
/// every triangle has corners of its own (farfeel-bench scene-apart); half a minute is for a slow machine.
inline constexpr std::uint64_t kDecodeMemoryBytes = std::uint64_t{1} << 30;
inline constexpr std::uint32_t kDecodeSeconds = 30;

/// What the program's first argument is where it is to decode instead of being itself.
inline constexpr const char* kDecodeApart = "--decode-meshes-apart";

/// Decodes by starting `program` anew. The limit of answer_bytes is set by the meshes.
[[nodiscard]] codecs::DecodeMeshes decode_meshes_apart(std::string program = "/proc/self/exe",
                                                       const transport::ApartLimits& = {kDecodeMemoryBytes,
                                                                                        kDecodeSeconds, 0});

/// For main, before anything else: whether these arguments ask for that, and
[[nodiscard]] bool is_asked_to_decode(std::span<char* const> arguments);
/// then what main is to return.
[[nodiscard]] int answer_with_meshes(std::span<char* const> arguments);

}  // namespace farfeel::master_station
