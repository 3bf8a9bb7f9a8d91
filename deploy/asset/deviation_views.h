// Where what is felt is off the mesh that it was made from, as colours.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "codecs/asset/asset.h"
#include "master_station/display/picture.h"

namespace farfeel::asset_views {

/// A mesh's triangles by how far their middles are from another surface: band k within first_m * 2^k, the last whatever
/// is farther.
inline constexpr std::size_t kBands = 6;
using Bands = std::array<geometry::TriangleMesh, kBands>;
[[nodiscard]] Bands by_distance(const geometry::TriangleMesh&, const geometry::TriangleMesh& other, double first_m);

/// The mesh's triangles in two: those whose middles lie on the other surface, and those that do not.
struct Parted {
  geometry::TriangleMesh on, off;
};
[[nodiscard]] Parted parted(const geometry::TriangleMesh&, const geometry::TriangleMesh& other);

struct DeviationPicture {
  master_station::Image image;
  std::string legend;  ///< the colours in words, with their distances
};
/// Side by side: what is felt by how far it is from the mesh, and the mesh by how far it is from what is felt.
/// given_M: in its own frame, with all that can be felt of the file; file_M: what the file has, there. What the bake
/// made up, over openings or behind sheets, is pale.
[[nodiscard]] tl::expected<DeviationPicture, master_station::DisplayError> deviation_picture(
    const codecs::Asset&, const geometry::TriangleMesh& given_M, const geometry::TriangleMesh& file_M, int height_px);

}  // namespace farfeel::asset_views
