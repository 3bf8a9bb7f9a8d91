// An asset: one rigid object with everything that is drawn and felt of it; and its file, a .glb that any glTF viewer
// opens. What is felt travels exactly; what is drawn is compressed with Draco and may move by its quantisation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/asset/followed_heights.h"
#include "codecs/mesh/colours.h"
#include "haptic_core/contact/material.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

/// What the hulls of the convex pieces do that they should not: reach out of the coarse solid, or past the middle
/// between the surface that a piece is of and the surface that faces the other way, by more than 50 um. As the bake
/// measured it.
struct HullBreaches {
  std::uint32_t outside = 0, past_middle = 0;           ///< pieces, <= piece_count
  double worst_outside_m = 0, worst_past_middle_m = 0;  ///< of all pieces, >= 0, counted or not
};

/// The object's own frame O has its origin at the centre of mass, so that an asset can serve as a tool as it is.
struct Asset {
  std::string name;
  geometry::TriangleMesh visible;       ///< what is drawn
  std::vector<Colour> visible_colours;  ///< one a vertex of it, or none
  geometry::HapticSurface felt;
  FeltDetail detail;  ///< what felt's tiles follow from; without triangles they are written one by one
  HullBreaches breaches;
  contact::Material material;
  double mass_kg = 0;             ///< > 0
  glm::dmat3 inertia_O_kg_m2{0};  ///< about O's origin, in O; symmetric, positive definite
  glm::dvec3 p_OM_O{0};           ///< where the origin M of the mesh it was made from is [m]; axes are the mesh's
};

struct AssetError {
  std::string message;  ///< what was tried, what was wrong, what to do
};
template <typename T>
using AssetResult = tl::expected<T, AssetError>;

/// What is wrong with an asset that is to be written or simulated; empty when all is well.
[[nodiscard]] std::vector<std::string> faults(const Asset&);

/// Fails if the asset has faults, if its tiles do not follow from its detail, or if Draco refuses the visible mesh.
[[nodiscard]] AssetResult<std::vector<std::byte>> write_asset(const Asset&);
/// The file that a path to write to means, links followed; it need not be there yet. Fails if it is something else than
/// a file (a folder, a device), or if its folder is not there.
[[nodiscard]] AssetResult<std::filesystem::path> target_of(const std::filesystem::path&);
/// Writes beside the path's target and renames: a reader sees the old file or the whole new one, and nothing is left
/// beside it where that fails.
[[nodiscard]] AssetResult<void> write_asset_file(const Asset&, const std::filesystem::path&);

/// Bytes may be hostile: structure, sizes, indices and values are checked before anything is allocated for them.
[[nodiscard]] AssetResult<Asset> read_asset(std::span<const std::byte> glb);
[[nodiscard]] AssetResult<Asset> read_asset_file(const std::filesystem::path&);

}  // namespace farfeel::codecs
