// Triangle meshes <-> Draco bitstreams: positions, connectivity and, if there are any, colours; edgebreaker, 14 bits a
// coordinate unless told, colours as they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/mesh/colours.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

inline constexpr int kPositionBits = 14;

/// Fails with a reason on an empty mesh, an index out of range, or a coordinate that is not finite or beyond 10 km: one
/// outlier would spend the whole grid. Vertices come back reordered; degenerate triangles and unused vertices do not.
/// Precondition: 1 <= position_bits <= 30; colours: one a vertex, or none.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> write_draco(const geometry::TriangleMesh&,
                                                                            int position_bits = kPositionBits,
                                                                            std::span<const Colour> colours = {});

/// For bytes from anybody. Only what write_draco() makes is read; see draco_bounds.h for what is checked before Draco
/// allocates. Indices and coordinates are checked afterwards.
[[nodiscard]] tl::expected<ColouredMesh, std::string> read_draco(std::span<const std::byte> bitstream,
                                                                 std::uint32_t max_triangles);

/// Why the mesh is not one that this format carries: see write_draco; nothing where it is.
[[nodiscard]] std::optional<std::string> fault_of(const geometry::TriangleMesh&);

// Bounds of a scene's meshes: the writer refuses to exceed them, the reader refuses them before it allocates.
inline constexpr std::size_t kMaxMeshBytes = 32u << 20;
inline constexpr std::uint32_t kMaxMeshTriangles = 2'000'000;
/// Of all meshes together, as claimed: some 300 MB decoded. Half a megabyte of bitstream can stand for a mesh's most.
inline constexpr std::uint64_t kMaxSceneTriangles = 4'000'000;

/// A mesh still coded.
struct CodedMesh {
  std::uint32_t triangles = 0;  ///< at most so many: as the scene claims
  std::span<const std::byte> bitstream;
};
/// Why these are not meshes of one scene, as far as that can be told before they are decoded; nothing where they are.
[[nodiscard]] std::optional<std::string> fault_of(std::span<const CodedMesh>);

/// As many meshes as are coded, each without a fault, or why not.
using DecodedMeshes = tl::expected<std::vector<ColouredMesh>, std::string>;
using DecodeMeshes = std::function<DecodedMeshes(std::span<const CodedMesh>)>;
/// In this process.
[[nodiscard]] DecodedMeshes decode_meshes(std::span<const CodedMesh>);

}  // namespace farfeel::codecs
