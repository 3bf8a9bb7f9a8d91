#include "deploy/asset/asset_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "slave_sim/models/height_plate.h"

namespace farfeel::asset_views {
namespace {

constexpr double kPeriod_m = 4e-3, kDepth_m = 0.5e-3;

TEST(AssetViewsTest, PiecesHoldEveryTriangleOnce) {
  geometry::HapticSurface plate = slave_sim::ridged_plate(kPeriod_m, kDepth_m);
  plate.piece_count = 2;
  for (std::size_t i = 0; i < plate.triangle_piece.size(); i += 2) plate.triangle_piece[i] = 1;
  const auto pieces = piece_meshes(plate);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].triangles.size() + pieces[1].triangles.size(), plate.coarse.triangles.size());
  EXPECT_EQ(pieces[1].positions_O.size(), 3 * pieces[1].triangles.size());
}

TEST(AssetViewsTest, DisplacedPointsLieOnTheFeltSurface) {
  const geometry::HapticSurface plate = slave_sim::ridged_plate(kPeriod_m, kDepth_m);
  const geometry::TriangleMesh felt = displaced_mesh(plate, 0.5e-3);
  double lowest = 0, area_m2 = 0;
  for (const geometry::Triangle& t : felt.triangles) {
    const glm::dvec3 &a = felt.positions_O[t[0]], &b = felt.positions_O[t[1]], &c = felt.positions_O[t[2]];
    if (glm::normalize(glm::cross(b - a, c - a)).z < 0.5) continue;  // not of the textured face
    area_m2 += 0.5 * glm::cross(glm::dvec3(b.x - a.x, b.y - a.y, 0), glm::dvec3(c.x - a.x, c.y - a.y, 0)).z;
    const double wave = 0.5 * kDepth_m * (std::cos(2 * std::numbers::pi * a.x / kPeriod_m) - 1);
    EXPECT_NEAR(a.z, wave, 2e-6);
    lowest = std::min(lowest, a.z);
  }
  EXPECT_NEAR(lowest, -kDepth_m, 5e-6);
  EXPECT_NEAR(area_m2, 0.040 * 0.030, 1e-7);
}

TEST(AssetViewsTest, DrawsThreeViews) {
  codecs::Asset asset;
  asset.felt = slave_sim::ridged_plate(kPeriod_m, kDepth_m);
  const auto image = picture(asset, 96);
  if (!image) GTEST_SKIP() << "skipped: no offscreen graphics: " << image.error().message;
  EXPECT_EQ(image->width, 3 * 96);
  EXPECT_EQ(image->height, 96);
  // Steel, a piece's colour, brass: the middles of the views differ.
  const auto pixel = [&](int view) { return image->rgba.at(4UL * (48 * 288 + 96 * view + 48)); };
  EXPECT_NE(pixel(0), pixel(2));
}

}  // namespace
}  // namespace farfeel::asset_views
