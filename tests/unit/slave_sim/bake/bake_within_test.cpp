#include "slave_sim/bake/bake_within.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "slave_sim/bake/detail.h"
#include "slave_sim/models/lattice_solid.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;

/// A cube of 40 mm whose sides have so many squares along an edge, moved by `place`.
template <typename Place>
TriangleMesh cube(std::uint32_t squares, const Place& place) {
  const LatticeSolid solid{.cuts_m = {{{-0.02, 0.02}, {-0.02, 0.02}, {-0.02, 0.02}}},
                           .steps = {{{squares}, {squares}, {squares}}},
                           .is_solid = [](int, int, int) { return true; }};
  return skin(solid, [&](const LatticePoint& at) { return place(at.p); });
}

/// A ball with large lumps: its coarse mesh, not its texture, decides how near what is felt can be.
TriangleMesh lumpy_ball() {
  return cube(30, [](const glm::dvec3& p) {
    const glm::dvec3 n = glm::normalize(p);
    return 0.020 * (1 + 0.4 * std::sin(11 * n.x) * std::sin(13 * n.y + 1) * std::cos(12 * n.z)) * n;
  });
}

double rms_m(const BakedWithin& within) {
  return std::max(within.baked.report.full_to_felt.rms_m, within.baked.report.felt_to_full.rms_m);
}

TEST(BakeWithinTest, ALargerErrorTakesFewerBytesAndBothAreMet) {
  std::size_t bytes_before = 0;
  for (const double asked_m : {600e-6, 200e-6}) {
    const auto within = bake_within("ball", lumpy_ball(), {}, asked_m);
    ASSERT_TRUE(within) << within.error().message;
    EXPECT_TRUE(within->is_met) << within->verdict;
    EXPECT_LE(rms_m(*within), asked_m);
    EXPECT_LE(within->baked.report.near_pairs_p95, kMostNearPairs);
    const std::size_t bytes = codecs::write_asset(within->baked.asset).value().size();
    EXPECT_GT(bytes, bytes_before);
    bytes_before = bytes;
    std::printf("%s\n", within->verdict.c_str());
  }
}

TEST(BakeWithinTest, TheSameInputGivesTheSameBytesWithinTheTrialsThatWereTold) {
  int bakes = 0;
  const Progress count = [&bakes](const std::string& stage, double) { bakes += stage.ends_with(": mass") ? 1 : 0; };
  const auto once = bake_within("ball", lumpy_ball(), {}, 200e-6, count);
  ASSERT_TRUE(once);
  EXPECT_GT(bakes, 2);
  EXPECT_LE(bakes, kMostTrials);
  EXPECT_EQ(codecs::write_asset(once->baked.asset).value(),
            codecs::write_asset(bake_within("ball", lumpy_ball(), {}, 200e-6)->baked.asset).value());
}

TEST(BakeWithinTest, WhereTheLoopsBoundRulesItSaysWhatTheErrorWouldTake) {
  const auto free = bake_within("ball", lumpy_ball(), {}, 100e-6);
  ASSERT_TRUE(free && free->is_met) << free->verdict;
  const std::uint32_t needed = free->baked.report.near_pairs_p95;
  ASSERT_GT(needed, 1U);
  const auto bound = bake_within("ball", lumpy_ball(), {}, 100e-6, {}, needed / 2);
  ASSERT_TRUE(bound);
  EXPECT_LE(bound->baked.report.near_pairs_p95, needed / 2);
  EXPECT_FALSE(bound->is_met);
  EXPECT_NE(bound->verdict.find("the loop's bound ruled, the error would take "), std::string::npos) << bound->verdict;
}

TEST(BakeWithinTest, HeightsFollowFromAMeshWhereThatTakesFewerBytes) {
  const auto within = bake_within("ball", lumpy_ball(), {}, 100e-6);
  ASSERT_TRUE(within && within->is_met);
  codecs::Asset asset = within->baked.asset;
  ASSERT_FALSE(asset.detail.mesh.triangles.empty());
  EXPECT_NE(within->verdict.find("heights follow from "), std::string::npos) << within->verdict;
  const std::size_t followed = felt_bytes(asset);
  asset.detail = {};
  EXPECT_LT(followed, felt_bytes(asset) / 4);
}

// A scan of few triangles is its facets: the curved surface through its corners is another shape.
TEST(BakeWithinTest, LargeFacetsAreDividedForWhatHeightsFollowFrom) {
  const TriangleMesh full = cube(12, [](const glm::dvec3& p) { return 0.02 * glm::normalize(p); });
  BakeOptions options;
  options.coarse_triangles = 300, options.texture = 256, options.height_step_m = 5e-6;
  const Baked baked = bake_asset("facets", full, options).value();
  const Details details(baked, full, options);
  const auto all = static_cast<std::uint32_t>(full.triangles.size());
  ASSERT_EQ(details.most_triangles(), 4 * all);
  const auto rms_with = [&](std::uint32_t triangles) {
    const BakeReport report = details.with(triangles, 40e-6).value().report;
    return std::max(report.full_to_felt.rms_m, report.felt_to_full.rms_m);
  };
  EXPECT_LT(rms_with(4 * all), 0.8 * rms_with(all));
}

TEST(BakeWithinTest, WhatNothingMeetsIsTold) {
  BakeOptions options;
  options.left_out = cube(1, [](const glm::dvec3& p) { return 0.1 * p + glm::dvec3(0, 0, 0.04); });
  const auto within = bake_within("cube", cube(1, [](const glm::dvec3& p) { return p; }), options, 1e-6);
  ASSERT_TRUE(within);
  EXPECT_FALSE(within->is_met);
  EXPECT_NE(within->verdict.find("meets the error"), std::string::npos) << within->verdict;
}

TEST(BakeWithinTest, UnaskedTheErrorIsAShareOfTheDiagonal) {
  EXPECT_NEAR(error_unasked_m(cube(1, [](const glm::dvec3& p) { return p; })), 0.0003 * 0.04 * std::sqrt(3), 1e-12);
}

/// Few triangles are tried where few do.
TEST(BakeWithinTest, AFlatShapeTakesFewTrianglesInFewBakes) {
  int bakes = 0;
  const Progress count = [&bakes](const std::string& stage, double) { bakes += stage.ends_with(": mass") ? 1 : 0; };
  const auto within = bake_within("cube", cube(20, [](const glm::dvec3& p) { return p; }), {}, 20e-6, count);
  ASSERT_TRUE(within && within->is_met);
  EXPECT_LT(within->baked.report.coarse_triangles, 60U);
  EXPECT_LE(bakes, 7);
}

/// Of flat sides whose triangles are a piece each, those within the disc where a ball of twice the radius meets them.
TEST(NearPairsTest, AreThePiecesUnderTheBall) {
  geometry::HapticSurface surface;
  surface.coarse = cube(40, [](const glm::dvec3& p) { return p; });
  for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) surface.triangle_piece.push_back(i);
  surface.piece_count = static_cast<std::uint32_t>(surface.triangle_piece.size());
  const double radius_m = 0.5 * kBallShare * 0.04 * std::sqrt(3), area_m2 = 0.5e-6;
  const double disc = std::numbers::pi * 3 * radius_m * radius_m / area_m2;
  EXPECT_GT(near_pairs_p95(surface), disc);
  EXPECT_LT(near_pairs_p95(surface), 3 * disc) << "those that its rim cuts, and those round an edge";
}

}  // namespace
}  // namespace farfeel::slave_sim
