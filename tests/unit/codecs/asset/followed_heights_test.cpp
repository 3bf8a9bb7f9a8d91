#include "codecs/asset/followed_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "codecs/asset/asset.h"
#include "codecs/asset/chart_heights.h"
#include "codecs/asset/curved_mesh.h"
#include "codecs/asset/felt_stream.h"
#include "haptic_core/geometry/piece_thickness.h"

namespace farfeel::codecs {
namespace {

using geometry::TriangleMesh;

constexpr double kRadius_m = 0.03;

/// A ball of rings x sectors triangles, its vertices on the sphere.
TriangleMesh ball(std::uint32_t rings, std::uint32_t sectors) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= rings; ++i) {
    for (std::uint32_t j = 0; j < (i % rings == 0 ? 1 : sectors); ++j) {
      const double polar = M_PI * i / rings, round = 2 * M_PI * j / sectors;
      mesh.positions_O.push_back(
          geometry::rounded_to_float(kRadius_m * glm::dvec3(std::sin(polar) * std::cos(round),
                                                            std::sin(polar) * std::sin(round), std::cos(polar))));
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t j) {
    return i == 0 ? 0 : i == rings ? (rings - 1) * sectors + 1 : (i - 1) * sectors + j % sectors + 1;
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) mesh.triangles.push_back({a, b, c});
  };
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sectors; ++j) {
      add(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      add(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return mesh;
}

/// A coarse ball, a piece and a chart to each side of a cube round it.
geometry::HapticSurface coarse_ball() {
  geometry::HapticSurface surface;
  surface.coarse = ball(6, 8);
  for (const geometry::Triangle& t : surface.coarse.triangles) {
    const glm::dvec3 n = geometry::unit_normal(surface.coarse, t);
    const int axis = std::abs(n.x) > std::abs(n.y)   ? (std::abs(n.x) > std::abs(n.z) ? 0 : 2)
                     : std::abs(n.y) > std::abs(n.z) ? 1
                                                     : 2;
    const auto side = static_cast<std::uint32_t>(2 * axis + (n[axis] > 0 ? 1 : 0));
    surface.triangle_piece.push_back(side);
    surface.triangle_chart.push_back(side);
  }
  surface.piece_count = 6;
  surface.charts.assign(6, {{}, 1, 1, 1, 0});  // to be numbered; what they are follows
  surface.tiles.resize(1);
  surface.piece_thickness_m = geometry::measured_thickness_m(surface);
  return stored_order(surface);
}

FeltDetail detail_of_ball() {
  return {.mesh = ball(12, 20), .reach_m = 0.008, .texel_m = 5e-4};
}

Asset ball_asset() {
  Asset asset;
  asset.name = "ball";
  asset.visible = ball(12, 20);
  asset.felt = coarse_ball();
  asset.detail = detail_of_ball();
  EXPECT_TRUE(follow(asset.felt, 6, asset.detail));
  asset.mass_kg = 0.1;
  asset.inertia_O_kg_m2 = glm::dmat3(1e-4);
  return asset;
}

double worst_off_m(const CurvedMesh& curved, double share) {
  double worst_m = 0;
  for (std::size_t t = 0; t < curved.size(); ++t) {
    for (const glm::dvec3& w : {glm::dvec3(1, 1, 1) / 3.0, glm::dvec3(share, 1 - share, 0), glm::dvec3(0, 0.5, 0.5)})
      worst_m = std::max(worst_m, std::abs(glm::length(curved.point(t, w)) - kRadius_m));
  }
  return worst_m;
}

TEST(CurvedMeshTest, RoundsWhatIsRoundAndLeavesWhatIsSharp) {
  const CurvedMesh round(ball(12, 20));
  EXPECT_LT(worst_off_m(round, 0.3), 1e-4) << "its flat triangles are 1 mm off";
  const CurvedMesh coarse(ball(2, 4));  // an octahedron: its sides meet at 70 degrees
  for (std::size_t t = 0; t < coarse.size(); ++t) {
    const glm::dvec3 third(1.0 / 3, 1.0 / 3, 1.0 / 3);
    EXPECT_NEAR(glm::length(coarse.point(t, third) - coarse.middle(t)), 0, 1e-9);
    EXPECT_LE(glm::length(coarse.point(t, {1, 0, 0}) - coarse.middle(t)), coarse.radius_m(t));
  }
}

// Cliffs all over, as a stranger's file may have them: one look forgets what looking again and again forgets.
TEST(ChartHeightsTest, CliffsAreForgottenInOneLook) {
  constexpr int kSide = 40;
  constexpr double kTexel_m = 1e-3, kSide_m = kSide * kTexel_m, kSteepest = 2.5;
  const geometry::TriangleMesh flat{{{0, 0, 0}, {kSide_m, 0, 0}, {kSide_m, kSide_m, 0}, {0, kSide_m, 0}},
                                    {{0, 1, 2}, {0, 2, 3}}};
  const std::array<std::uint32_t, 2> triangles{0, 1};
  const geometry::Chart chart{.X_OH = {}, .texel_m = kTexel_m, .columns = kSide, .rows = kSide, .first_tile = 0};
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> steps(-6, 6);  // whole ones, so that some are as far off as others
    std::vector<double> z(kSide * kSide);
    for (double& height : z) height = steps(random) * kTexel_m;
    const auto height = [&](const glm::dvec2& at_m, double near_m, double) -> std::optional<double> {
      return z[static_cast<std::size_t>(at_m.y / kTexel_m) * kSide + static_cast<std::size_t>(at_m.x / kTexel_m)] -
             near_m;
    };
    const ChartHeights heights = chart_heights(flat, triangles, chart, height, 1, 1);
    ASSERT_EQ(heights.own, z.size());

    std::vector<bool> is_forgotten(z.size());
    for (bool has_changed = true; has_changed;) {
      has_changed = false;
      for (int at = 0; at < kSide * kSide; ++at) {
        for (const int step : {1, -1, kSide, -kSide}) {
          const int other = at + step;
          const bool is_neighbour =
              other >= 0 && other < kSide * kSide && (std::abs(step) == kSide || other / kSide == at / kSide);
          if (is_forgotten[at] || !is_neighbour || is_forgotten[other]) continue;
          if (std::abs(z[other] - z[at]) <= kSteepest * kTexel_m || std::abs(z[at]) < std::abs(z[other])) continue;
          is_forgotten[at] = has_changed = true;
        }
      }
    }
    const auto forgotten = static_cast<std::uint64_t>(std::count(is_forgotten.begin(), is_forgotten.end(), true));
    EXPECT_GT(forgotten, z.size() / 4);
    EXPECT_EQ(heights.missed, forgotten) << "seed " << seed;
  }
}

TEST(FollowedHeightsTest, AreThoseOfTheCurvedSurface) {
  const Asset asset = ball_asset();
  ASSERT_EQ(asset.felt.charts.size(), 6U);
  EXPECT_TRUE(geometry::faults(asset.felt).empty());
  double worst_m = 0;
  std::uint64_t own = 0, missed = 0;
  geometry::HapticSurface again = asset.felt;
  const auto charts = follow(again, 6, asset.detail).value();
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const geometry::Chart& chart = asset.felt.charts[c];
    own += charts[c].own, missed += charts[c].missed;
    for (std::uint32_t texel = 0; texel < chart.columns * chart.rows; ++texel) {
      if (!charts[c].is_own[texel]) continue;
      const double s = (texel % chart.columns + 0.5) * chart.texel_m, t = (texel / chart.columns + 0.5) * chart.texel_m;
      const glm::dvec3 p_O =
          spatial::transform_point(chart.X_OH, {s, t, geometry::sample_height(asset.felt, chart, s, t).h_m});
      worst_m = std::max(worst_m, std::abs(glm::length(p_O) - kRadius_m));
    }
  }
  EXPECT_GT(own, 20'000U);
  EXPECT_EQ(missed, 0U);
  EXPECT_LT(worst_m, 1.5e-4);
}

TEST(FollowedHeightsTest, AnAssetIsReadAsItWasWrittenInAFractionOfTheBytes) {
  const Asset asset = ball_asset();
  const Asset back = read_asset(write_asset(asset).value()).value();
  ASSERT_EQ(back.felt.tiles.size(), asset.felt.tiles.size());
  for (std::size_t i = 0; i < back.felt.tiles.size(); ++i)
    EXPECT_EQ(back.felt.tiles[i].coefficients, asset.felt.tiles[i].coefficients);
  EXPECT_EQ(back.felt.scale.scale_m, asset.felt.scale.scale_m);
  EXPECT_EQ(back.detail.mesh.positions_O, asset.detail.mesh.positions_O);
  EXPECT_TRUE(write_asset(back)) << "and can be written again";
  EXPECT_LT(encoded_felt(asset.felt, asset.detail.mesh).size(), encoded_felt(asset.felt).size() / 4);
}

TEST(FollowedHeightsTest, TilesThatDoNotFollowAreNotWritten) {
  Asset asset = ball_asset();
  asset.felt.tiles[0].coefficients[100] ^= 1;
  const auto written = write_asset(asset);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("leave that out"), std::string::npos);
  asset.detail = {};
  EXPECT_TRUE(write_asset(asset));
}

TEST(FollowedHeightsTest, WhatTakesTooMuchOrIsNoNumberIsRefused) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN(), kEndless = std::numeric_limits<double>::infinity();
  for (const double texel_m : {0.0, -1.0, kNone, kEndless, 1e-9, 1e-300}) {
    geometry::HapticSurface surface = coarse_ball();
    FeltDetail detail = detail_of_ball();
    detail.texel_m = texel_m;
    if (texel_m == kEndless) {
      (void)follow(surface, 6, detail);
    } else {
      EXPECT_FALSE(follow(surface, 6, detail)) << texel_m;
    }
  }
  for (const double wild : {kNone, kEndless, 1e30, -1e300}) {
    geometry::HapticSurface surface = coarse_ball();
    FeltDetail detail = detail_of_ball();
    detail.mesh.positions_O[7].y = wild;
    (void)follow(surface, 6, detail);
    surface = coarse_ball();
    surface.coarse.positions_O[7].y = wild;
    EXPECT_FALSE(follow(surface, 6, detail_of_ball())) << wild;
  }
  geometry::HapticSurface surface = coarse_ball();
  EXPECT_FALSE(follow(surface, 7, detail_of_ball())) << "a chart without triangles";
  FeltDetail layered = detail_of_ball();
  for (int doubling = 0; doubling < 6; ++doubling) {
    const std::vector<geometry::Triangle> so_far = layered.mesh.triangles;
    layered.mesh.triangles.insert(layered.mesh.triangles.end(), so_far.begin(), so_far.end());
  }
  layered.texel_m = 2.5e-5;
  EXPECT_FALSE(follow(surface, 6, layered)) << "64 layers";
}

}  // namespace
}  // namespace farfeel::codecs
