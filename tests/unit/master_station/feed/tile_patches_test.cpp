// A tile is drawn where it is felt, and one that no part of the surface needs is not.
#include "master_station/feed/tile_patches.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "slave_sim/models/height_plate.h"

namespace farfeel::master_station {
namespace {

using Triangle = std::array<glm::dvec3, 3>;

double area_m2(const Triangle& t) {
  return 0.5 * glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
}

TEST(TilePatches, CoverWhatHasAChartOnceAndLieOnIt) {
  const geometry::HapticSurface plate = slave_sim::ridged_plate(3e-3, 0.0);  // flat: areas are those of the coarse mesh
  const std::vector<TilePatch> patches = tile_patches(plate);
  ASSERT_FALSE(patches.empty());
  double of_chart_m2 = 0, of_patches_m2 = 0;
  for (std::size_t i = 0; i < plate.triangle_chart.size(); ++i) {
    if (plate.triangle_chart[i] == geometry::kNoChart) continue;
    const auto& [a, b, c] = plate.coarse.triangles[i];
    of_chart_m2 += area_m2({plate.coarse.positions_O[a], plate.coarse.positions_O[b], plate.coarse.positions_O[c]});
  }
  std::vector<bool> seen(plate.tiles.size(), false);
  const geometry::Chart& chart = plate.charts.at(0);
  const spatial::Pose X_HO = spatial::inverse(chart.X_OH);
  for (const TilePatch& patch : patches) {
    ASSERT_LT(patch.tile, seen.size());
    EXPECT_FALSE(seen[patch.tile]);
    seen[patch.tile] = true;
    for (const Triangle& triangle : patch.triangles_O) {
      of_patches_m2 += area_m2(triangle);
      const glm::dvec3 middle_H = spatial::transform_point(X_HO, (triangle[0] + triangle[1] + triangle[2]) / 3.0);
      const auto at = static_cast<std::uint32_t>(middle_H.x / (chart.texel_m * geometry::kTileTexels));
      EXPECT_EQ(patch.tile % chart.tiles_across(), std::min(at, chart.tiles_across() - 1));
    }
  }
  EXPECT_NEAR(of_patches_m2, of_chart_m2, 1e-3 * of_chart_m2);
}

TEST(TilePatches, FollowTheHeights) {
  const geometry::HapticSurface plate = slave_sim::ridged_plate(3e-3, 0.3e-3);
  const geometry::Chart& chart = plate.charts.at(0);
  double low_m = 1, high_m = -1;
  for (const TilePatch& patch : tile_patches(plate)) {
    for (const Triangle& triangle : patch.triangles_O) {
      for (const glm::dvec3& corner : triangle) {
        const glm::dvec3 p_H = spatial::transform_point(spatial::inverse(chart.X_OH), corner);
        EXPECT_NEAR(p_H.z, geometry::sample_height(plate, chart, p_H.x, p_H.y).h_m, 1e-9);
        low_m = std::min(low_m, p_H.z), high_m = std::max(high_m, p_H.z);
      }
    }
  }
  EXPECT_GT(high_m, low_m);
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
