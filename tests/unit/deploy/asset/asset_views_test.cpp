#include "deploy/asset/asset_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deploy/asset/deviation_views.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

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

TEST(AssetViewsTest, ASliverIsDividedByItsArea) {
  geometry::TriangleMesh mesh;
  mesh.positions_O = {{0, 0, 0}, {0.1, 0, 0}, {0.1, 1e-6, 0}, {0, 0, 0.02}, {0.02, 0, 0.02}, {0, 0.02, 0.02}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_LE(divided(mesh, 1e-4).triangles.size(), 100U) << "by its length a million";
  mesh.triangles = {{3, 4, 5}};
  const geometry::TriangleMesh even = divided(mesh, 1e-3);
  EXPECT_GE(even.triangles.size(), 400U);
  for (const geometry::Triangle& t : even.triangles)
    EXPECT_LE(glm::distance(even.positions_O[t[0]], even.positions_O[t[1]]), 1.01e-3);
}

TEST(DeviationViewsTest, EveryTriangleIsInTheBandOfItsDistance) {
  const geometry::TriangleMesh box = support::box_mesh(glm::dvec3(0.02)), mesh = divided(box, 2e-3);
  geometry::TriangleMesh higher = mesh;
  for (glm::dvec3& p : higher.positions_O) p.z += p.z > 0 ? 7e-5 : 0;  // the sides become longer: none of that is off
  const Bands bands = by_distance(higher, box, 1e-5);
  std::size_t sum = 0;
  for (const geometry::TriangleMesh& band : bands) sum += band.triangles.size();
  EXPECT_EQ(sum, mesh.triangles.size());
  EXPECT_EQ(bands[0].triangles.size(), mesh.triangles.size() / 6 * 5);
  EXPECT_EQ(bands[3].triangles.size(), mesh.triangles.size() / 6) << "between 40 and 80 um";
}

TEST(DeviationViewsTest, WhatTheFileLacksIsToldApart) {
  const geometry::TriangleMesh box = divided(support::box_mesh(glm::dvec3(0.02)), 2e-3);
  geometry::TriangleMesh open = box;
  std::erase_if(open.triangles, [&](const geometry::Triangle& t) { return geometry::unit_normal(box, t).z > 0.9; });
  const Parted parts = parted(box, open);
  EXPECT_EQ(parts.on.triangles, open.triangles);
  EXPECT_EQ(parts.off.triangles.size(), box.triangles.size() / 6);
}

TEST(DeviationViewsTest, DrawsBothWaysWithALegend) {
  codecs::Asset asset;
  asset.felt = slave_sim::ridged_plate(kPeriod_m, kDepth_m);
  asset.p_OM_O = {0.5, 0, 0};
  geometry::TriangleMesh given = asset.felt.coarse;  // without the ridges, in a frame of its own
  for (glm::dvec3& p : given.positions_O) p.x -= 0.5;
  geometry::TriangleMesh file = given;
  const auto drawn = deviation_picture(asset, given, file, 96);
  if (!drawn) GTEST_SKIP() << "skipped: no offscreen graphics: " << drawn.error().message;
  EXPECT_EQ(drawn->image.width, 2 * 96);
  EXPECT_NE(drawn->legend.find("violet within 50 um, blue within 100 um"), std::string::npos) << drawn->legend;
  EXPECT_EQ(drawn->legend.find("pale"), std::string::npos) << drawn->legend;
  file.triangles.resize(file.triangles.size() / 2);
  const std::string legend = deviation_picture(asset, given, file, 96).value().legend;
  EXPECT_NE(legend.find("; pale: made up by the bake"), std::string::npos) << legend;
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
