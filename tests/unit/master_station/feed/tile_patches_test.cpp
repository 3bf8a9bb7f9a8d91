// A tile is drawn where it is felt, and one that no part of the surface needs is not.
#include "master_station/feed/tile_patches.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "slave_sim/models/height_plate.h"

namespace farfeel::master_station {
namespace {

TEST(TilePatches, LieOnTheSurfaceAndAreEachTileOnce) {
  const geometry::HapticSurface plate = slave_sim::ridged_plate(3e-3, 0.3e-3);
  const std::vector<TilePatch> patches = tile_patches(plate);
  ASSERT_FALSE(patches.empty());
  ASSERT_LE(patches.size(), plate.tiles.size());
  std::vector<bool> seen(plate.tiles.size(), false);
  const geometry::Box box = geometry::bounding_box(plate.coarse);
  const geometry::Chart& chart = plate.charts.at(0);
  for (const TilePatch& patch : patches) {
    ASSERT_LT(patch.tile, seen.size());
    EXPECT_FALSE(seen[patch.tile]);
    seen[patch.tile] = true;
    glm::dvec3 middle(0);
    for (const glm::dvec3& corner : patch.corner_O) middle += 0.25 * corner;
    const double most_m = chart.texel_m * geometry::kTileTexels;
    EXPECT_LT(middle.x, box.high.x + most_m);
    EXPECT_GT(middle.x, box.low.x - most_m);
    EXPECT_LT(glm::distance(patch.corner_O[0], patch.corner_O[1]), 1.5 * most_m);
  }
}

TEST(TilePatches, OneThatReachesNoTriangleOfItsChartIsLeftAway) {
  geometry::HapticSurface plate = slave_sim::ridged_plate(3e-3, 0.3e-3);
  const std::size_t all = tile_patches(plate).size();
  // Of the plate's chart only one triangle is left.
  bool is_first = true;
  for (std::uint32_t& chart : plate.triangle_chart) {
    if (chart == geometry::kNoChart) continue;
    if (!is_first) chart = geometry::kNoChart;
    is_first = false;
  }
  const std::size_t left = tile_patches(plate).size();
  EXPECT_GT(left, 0U);
  EXPECT_LT(left, all);
}

}  // namespace
}  // namespace farfeel::master_station
