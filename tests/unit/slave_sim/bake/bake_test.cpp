#include "slave_sim/bake/bake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "codecs/asset/felt_stream.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;

/// A ball of radius 20 mm with bumps of 10 mm wavelength, 0.3 mm high: smooth everywhere, so the bake has no excuse.
TriangleMesh bumpy_ball() {
  const LatticeSolid cube{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                          .steps = {{{40}, {40}, {40}}},
                          .is_solid = [](int, int, int) { return true; }};
  return skin(cube, [](const LatticePoint& at) {
    const glm::dvec3 n = glm::normalize(at.p);
    const glm::dvec3 p = 0.020 * n;
    return p + 1e-4 * (std::sin(628 * p.x) + std::sin(628 * p.y) + std::sin(628 * p.z)) * n;
  });
}

TEST(BakeTest, ASmoothBallIsFeltWithinMicrometres) {
  std::vector<std::string> stages;
  const auto baked = bake_asset("ball", bumpy_ball(), {.coarse_triangles = 100, .texture = 200},
                                [&](const std::string& stage, double) { stages.push_back(stage); });
  ASSERT_TRUE(baked) << baked.error().message;
  const BakeReport& report = baked->report;
  EXPECT_TRUE(codecs::faults(baked->asset).empty());
  EXPECT_GE(stages.size(), 5U);
  EXPECT_EQ(report.missed_texels, 0U);
  EXPECT_LE(report.coarse_triangles, 100U);
  EXPECT_LT(report.full_to_felt.rms_m, 5e-6);
  EXPECT_LT(report.felt_to_full.rms_m, 5e-6);
  EXPECT_LT(report.full_to_felt.max_m, 100e-6);
  EXPECT_LT(report.seam_step.rms_m, 1.5 * report.felt_to_full.rms_m);  // both sides have that error
  EXPECT_LT(report.seam_step.max_m, report.felt_to_full.max_m);
  EXPECT_GT(report.seam_slope.rms, 0);
  EXPECT_LT(report.seam_slope.rms, 1.5 * report.felt_slope.rms);
  EXPECT_NEAR(baked->asset.mass_kg, 1200 * 4 / 3.0 * 3.14159 * 8e-6, 0.001);
}

/// What is felt of it takes so many bytes.
std::size_t felt_bytes(const Baked& baked) {
  return codecs::encoded_felt(baked.asset.felt).size();
}

TEST(BakeTest, FewBytesCostOnlyWhatHeightsAreRoundedBy) {
  const BakeOptions exact{.coarse_triangles = 100, .texture = 200};
  BakeOptions rounded = exact;
  rounded.height_step_m = 4e-6;
  const Baked long_one = bake_asset("ball", bumpy_ball(), exact).value();
  const Baked short_one = bake_asset("ball", bumpy_ball(), rounded).value();
  EXPECT_TRUE(codecs::faults(short_one.asset).empty());
  EXPECT_TRUE(geometry::is_closed_and_oriented(short_one.asset.felt.coarse));
  EXPECT_LT(felt_bytes(short_one), felt_bytes(long_one) / 2);
  const double rounding_m = rounded.height_step_m / std::sqrt(12.0);
  const auto most_m = [&](const Deviation& d) { return 1.15 * std::hypot(d.rms_m, rounding_m); };
  EXPECT_LT(short_one.report.felt_to_full.rms_m, most_m(long_one.report.felt_to_full));
  EXPECT_LT(short_one.report.full_to_felt.rms_m, most_m(long_one.report.full_to_felt));
  EXPECT_LT(short_one.report.seam_step.rms_m, most_m(long_one.report.seam_step));
  EXPECT_EQ(short_one.report.coarse_triangles, long_one.report.coarse_triangles);
  // Vertices stand on a grid.
  for (const glm::dvec3& p : short_one.asset.felt.coarse.positions_O) EXPECT_EQ(p * 0x1p17, glm::round(p * 0x1p17));
}

TEST(BakeTest, AStrokeAcrossAChartBorderOfAModelFeelsNoMoreThanTheBakesOwnError) {
  const Model& torus = *find_model("torus");
  BakeOptions options = model_bake_options(torus);
  options.texture = 512;
  const BakeReport report = bake_asset("torus", torus.full_mesh(), options).value().report;
  EXPECT_GT(report.charts, 50U);
  EXPECT_LT(report.felt_to_full.rms_m, 20e-6);
  EXPECT_LT(report.full_to_felt.rms_m, 20e-6);
  // Both sides have that error: the root of two, and some more where three charts meet.
  EXPECT_LT(report.seam_step.rms_m, 1.6 * report.felt_to_full.rms_m);
  EXPECT_LT(report.seam_slope.rms, 1.5 * report.felt_slope.rms);
}

TEST(BakeTest, TheTextureKeepsItsBudgetAndTheErrorFallsWithIt) {
  double before = 1;
  for (const std::uint32_t texture : {64U, 128U, 256U}) {
    const auto baked = bake_asset("ball", bumpy_ball(), {.coarse_triangles = 100, .texture = texture});
    ASSERT_TRUE(baked);
    std::uint64_t texels = 0;
    for (const geometry::Chart& chart : baked->asset.felt.charts)
      texels += static_cast<std::uint64_t>(chart.columns) * chart.rows;
    EXPECT_LE(texels, texture * texture);
    EXPECT_LT(baked->report.full_to_felt.rms_m, before);
    before = baked->report.full_to_felt.rms_m;
  }
}

TEST(BakeTest, SaysWhatTheTexelsLoseAndWhichTextureWouldNot) {
  const auto block_at = [](std::uint32_t texture) {  // ridges of 6 mm; texels of 3.5 and 0.4 mm
    BakeOptions options{.texture = texture};
    options.coarse = block_base();
    return bake_asset("block", block_mesh(), options).value().report;
  };
  const BakeReport coarse = block_at(64), fine = block_at(400);
  EXPECT_GT(coarse.lost_share, 0.3);
  EXPECT_LT(fine.lost_share, 0.05);
  EXPECT_GT(coarse.keeping_texture, 64U);
  EXPECT_LT(fine.full_to_felt.rms_m, 0.2 * coarse.full_to_felt.rms_m);
}

/// A plate of 40 x 40 x 8 mm with ridges across x, 0.05 mm deep, on its large faces; steps along x of a tenth of them.
BakeReport auto_baked_plate(double wavelength_m) {
  const auto plate = [](std::uint32_t along_x, std::uint32_t along_y) {
    return LatticeSolid{.cuts_m = {{{-0.020, 0.020}, {-0.020, 0.020}, {-0.004, 0.004}}},
                        .steps = {{{along_x}, {along_y}, {along_y / 8 + 1}}},
                        .is_solid = [](int, int, int) { return true; }};
  };
  const TriangleMesh full =
      skin(plate(static_cast<std::uint32_t>(0.400 / wavelength_m), 16), [&](const LatticePoint& at) {
        const double height_m = 25e-6 * std::cos(2 * std::numbers::pi * at.p.x / wavelength_m);
        return glm::dvec3(at.p.x, at.p.y, at.p.z * (1 + height_m / 0.004));
      });
  BakeOptions options{.texture = kTextureAuto};
  options.coarse = skin(plate(1, 1), [](const LatticePoint& at) { return at.p; });
  return bake_asset("plate", full, options).value().report;
}

/// A cube of 40 mm, and what is left out of it: a speck that stands out 1 mm, and a fin of 2 mm.
TEST(BakeTest, WhatWasLeftOutCountsInTheDeviation) {
  const auto cube = [](double half_m, const glm::dvec3& middle) {
    const LatticeSolid solid{.cuts_m = {{{-half_m, half_m}, {-half_m, half_m}, {-half_m, half_m}}},
                             .steps = {{{2}, {2}, {2}}},
                             .is_solid = [](int, int, int) { return true; }};
    return skin(solid, [&](const LatticePoint& at) { return at.p + middle; });
  };
  const glm::dvec3 far(0.5, -0.25, 0);  // where the mesh's own frame is
  BakeOptions options{.coarse_triangles = 48, .texture = 256};
  const BakeReport without = bake_asset("cube", cube(0.020, far), options).value().report;
  options.left_out = cube(0.0015, far + glm::dvec3(0, 0, 0.0205));
  const BakeReport with = bake_asset("cube", cube(0.020, far), options).value().report;
  const double share = 6 * 9.0 / (6 * 1600 + 6 * 9);
  EXPECT_LT(without.full_to_felt.rms_m, 5e-6);
  EXPECT_GT(with.full_to_felt.rms_m, 0.001 * std::sqrt(share / 2));
  EXPECT_NEAR(with.full_to_felt.max_m, 0.002, 1e-4);
  EXPECT_NEAR(with.full_to_felt.p_max_M.z, 0.022, 1e-9);
  EXPECT_NEAR(with.full_to_felt.p_max_M.x, 0.5, 0.002);
  EXPECT_NEAR(with.thickness_m, 0.040, 1e-6);
  options.left_out = {{far + glm::dvec3(0, 0, 0.020), far + glm::dvec3(0.001, 0, 0.020), far + glm::dvec3(0, 0, 0.022)},
                      {{0, 1, 2}}};
  EXPECT_NEAR(bake_asset("cube", cube(0.020, far), options).value().report.full_to_felt.max_m, 0.002, 1e-4)
      << "though hardly a sample falls on it";
}

/// No chart has four texels together: nothing but the coarse mesh is there to measure against.
TEST(BakeTest, TheSmallestTextureIsMeasuredAsWell) {
  const LatticeSolid cube{.cuts_m = {{{-0.02, 0.02}, {-0.02, 0.02}, {-0.02, 0.02}}},
                          .steps = {{{2}, {2}, {2}}},
                          .is_solid = [](int, int, int) { return true; }};
  const auto baked = bake_asset("cube", skin(cube, [](const LatticePoint& at) { return at.p; }),
                                {.coarse_triangles = 12, .texture = 16});
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_LT(baked->report.full_to_felt.max_m, 0.02);
}

TEST(BakeTest, AnotherShapeIsToldLoudly) {
  BakeReport report;
  report.thickness_m = 0.010;
  report.full_to_felt.rms_m = 1.9e-4;
  EXPECT_FALSE(words_about_deviation(report));
  report.felt_to_full = {.rms_m = 2.2e-4, .max_m = 0.003, .p_max_M = {0.1, 0.2, 0.3}};
  const auto words = words_about_deviation(report);
  ASSERT_TRUE(words);
  EXPECT_NE(
      words->find("220 um rms from it, more than 2 % of its median thickness of 10 mm, and 3 mm at (0.1, 0.2, 0.3)"),
      std::string::npos)
      << *words;
}

TEST(BakeTest, AutoPicksTheTextureThatKeepsTheSpectrum) {
  const BakeReport fine = auto_baked_plate(0.0004), finer = auto_baked_plate(0.00025);
  for (const auto& [report, wavelength_m] : {std::pair{fine, 0.0004}, std::pair{finer, 0.00025}}) {
    SCOPED_TRACE(wavelength_m);
    EXPECT_LT(report.texel_m, wavelength_m / 2) << "ridges are not aliased";
    EXPECT_GT(report.texel_m, wavelength_m / 8) << "nor many texels wasted on them";
    EXPECT_LT(report.lost_share, 0.002);
    EXPECT_NEAR(report.keeping_texture, report.texture, 0.25 * report.texture) << "the choice is its own answer";
    EXPECT_LT(report.full_to_felt.rms_m, 8e-6);
  }
  EXPECT_NEAR(static_cast<double>(finer.texture) / fine.texture, 1.6, 0.4);
}

TEST(BakeTest, MadeUpHeightsStayNearTheKnownOnes) {
  const auto baked = bake_asset("ball", bumpy_ball(), {.coarse_triangles = 100, .texture = 400});
  ASSERT_TRUE(baked);
  EXPECT_LT(65535 * baked->asset.felt.scale.scale_m, 0.040);  // the ball's own diameter
}

TEST(BakeTest, MovingTheMeshMovesOnlyTheOrigin) {
  TriangleMesh moved = bumpy_ball();
  for (glm::dvec3& p : moved.positions_O) p += glm::dvec3(0.5, -0.25, 0.125);
  const BakeOptions options{.coarse_triangles = 60, .texture = 64};
  const auto here = bake_asset("ball", bumpy_ball(), options), there = bake_asset("ball", moved, options);
  ASSERT_TRUE(here && there);
  EXPECT_LT(glm::length(there->report.p_MO_M - here->report.p_MO_M - glm::dvec3(0.5, -0.25, 0.125)), 1e-12);
  EXPECT_NEAR(there->asset.mass_kg, here->asset.mass_kg, 1e-9);
}

TEST(BakeTest, RefusesWhatItCannotBakeAndSaysWhy) {
  const auto refusal = [](auto spoil) {
    TriangleMesh mesh = bumpy_ball();
    BakeOptions options{.coarse_triangles = 60, .texture = 64};
    spoil(mesh, options);
    const auto baked = bake_asset("ball", mesh, options);
    return baked ? std::string() : baked.error().message;
  };
  EXPECT_NE(refusal([](TriangleMesh& m, BakeOptions&) { m.triangles.clear(); }), "");
  EXPECT_NE(refusal([](TriangleMesh& m, BakeOptions&) { m.triangles.pop_back(); }).find("closed"), std::string::npos);
  EXPECT_NE(refusal([](TriangleMesh& m, BakeOptions&) { m.positions_O[7].y = std::nan(""); }).find("finite"),
            std::string::npos);
  EXPECT_NE(refusal([](TriangleMesh& m, BakeOptions&) { m.triangles[0][0] = 1U << 30; }), "");
  EXPECT_NE(refusal([](TriangleMesh& m, BakeOptions&) {
              for (auto& t : m.triangles) std::swap(t[0], t[1]);
            }).find("inwards"),
            std::string::npos);
  EXPECT_NE(refusal([](TriangleMesh&, BakeOptions& o) { o.texture = 8; }), "");
  EXPECT_NE(refusal([](TriangleMesh&, BakeOptions& o) { o.density_kg_per_m3 = -1; }), "");
}

TEST(AssetCacheTest, BakesOnceAndReadsAfterwards) {
  const test_support::PrivateFolder around;
  const auto folder = std::filesystem::path(around / "cache");
  int stages = 0;
  const auto count = [&](const std::string&, double) { ++stages; };
  const auto first = cached_model_asset("block", folder, count);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_GT(stages, 0);
  EXPECT_EQ(first->felt.piece_count, 1U);
  EXPECT_EQ(first->felt.coarse.triangles.size(), 16U);

  stages = 0;
  const auto second = cached_model_asset("block", folder, count);
  ASSERT_TRUE(second);
  EXPECT_EQ(stages, 0);
  EXPECT_EQ(second->felt.coarse.positions_O, first->felt.coarse.positions_O);
  EXPECT_EQ(second->visible.positions_O, first->visible.positions_O);

  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ofstream(entry.path(), std::ios::trunc) << "broken";
  }
  EXPECT_TRUE(cached_model_asset("block", folder, count)) << "a broken file is baked again";
  EXPECT_GT(stages, 0);

  std::string told;
  std::ofstream(around / "file") << "no folder";
  const auto unkept = cached_model_asset("block", around / "file", {}, [&](const std::string& line) { told = line; });
  ASSERT_TRUE(unkept) << unkept.error().message;
  EXPECT_EQ(unkept->visible.positions_O, first->visible.positions_O) << "the same as what a cache would give";
  EXPECT_NE(told.find(around / "file"), std::string::npos) << told;

  const auto none = cached_model_asset("no such thing", folder);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("block"), std::string::npos) << "names what there is";
}

}  // namespace
}  // namespace farfeel::slave_sim
