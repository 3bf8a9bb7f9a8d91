// Ways to send a triangle mesh's positions and connectivity: ours, and others' to measure it against.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::bench {

struct MeshCodec {
  std::string name;
  std::function<std::vector<std::byte>(const geometry::TriangleMesh&)> encode;  ///< empty: it refuses the mesh
  std::function<geometry::TriangleMesh(std::span<const std::byte>)> decode;     ///< of its own bytes
};

/// All on the same grid of codecs::kPositionBits but the raw ones, which are f32 and u32:
///   draco           as scenes and assets are coded
///   draco_smallest  Draco's slowest and shortest: what it can do at best
///   meshopt_zstd    meshoptimizer's vertex and index codecs, after its own reordering, under zstd; where this build
///                   has libzstd
///   raw_zstd        under zstd alone; likewise
[[nodiscard]] std::vector<MeshCodec> mesh_codecs();

/// Under zstd at this level; as they are where this build lacks libzstd.
[[nodiscard]] bool has_zstd();
[[nodiscard]] std::vector<std::byte> zstd_packed(std::span<const std::byte>, int level);
[[nodiscard]] std::vector<std::byte> zstd_unpacked(std::span<const std::byte>);

}  // namespace farfeel::bench
