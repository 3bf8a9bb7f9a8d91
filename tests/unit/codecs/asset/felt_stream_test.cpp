#include "codecs/asset/felt_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <tuple>

namespace farfeel::codecs {
namespace {

using geometry::HapticSurface;

/// A ball of rings x sectors, in pieces of two sectors, each with a chart of its own, all from `random`.
HapticSurface ball(std::mt19937& random, double grid_m = 0, std::uint32_t rings = 9, std::uint32_t sectors = 12) {
  HapticSurface out;
  const auto number = [&](double most) { return std::uniform_real_distribution<double>(-most, most)(random); };
  const auto add = [&](const glm::dvec3& p) {
    out.coarse.positions_O.push_back(grid_m > 0 ? glm::round(p / grid_m) * grid_m + 0.0
                                                : geometry::rounded_to_float(p + 1e-4 * number(1)));
  };
  for (std::uint32_t i = 0; i <= rings; ++i) {
    for (std::uint32_t j = 0; j < (i % rings == 0 ? 1 : sectors); ++j) {
      const double polar = 3.14159 * i / rings, round = 2 * 3.14159 * j / sectors;
      add(0.03 * glm::dvec3(std::sin(polar) * std::cos(round), std::sin(polar) * std::sin(round), std::cos(polar)));
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t j) {
    return i == 0 ? 0 : i == rings ? (rings - 1) * sectors + 1 : (i - 1) * sectors + j % sectors + 1;
  };
  const auto add_triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t sector) {
    if (a == b || b == c || c == a) return;
    out.coarse.triangles.push_back({a, b, c});
    out.triangle_piece.push_back(sector / 2);
    out.triangle_chart.push_back(sector / 2);
  };
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sectors; ++j) {
      add_triangle(at(i, j), at(i + 1, j), at(i + 1, j + 1), j);
      add_triangle(at(i, j), at(i + 1, j + 1), at(i, j + 1), j);
    }
  }
  out.piece_count = sectors / 2;
  for (std::uint32_t piece = 0; piece < out.piece_count; ++piece) {
    out.piece_thickness_m.push_back(static_cast<float>(0.02 + number(0.01)));
    const glm::dvec3 p(number(0.03), number(0.03), number(0.03)), turn(number(2), number(2), number(2));
    spatial::Pose X{spatial::rotation_from_vector(turn), p};
    if (grid_m > 0) X = frame_on_grid(X, 4 * grid_m);
    const auto side = [&] { return static_cast<std::uint32_t>(20 + random() % 40); };
    geometry::Chart chart{X, 1e-4, side(), side(), static_cast<std::uint32_t>(out.tiles.size())};
    for (std::uint32_t n = 0; n < chart.tiles_across() * chart.tiles_down(); ++n) {
      geometry::HeightTile& tile = out.tiles.emplace_back();
      tile.version = random() % 2;
      for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(random() % 100);  // fits no neighbour
    }
    out.charts.push_back(chart);
  }
  return out;
}

void expect_same(const HapticSurface& a, const HapticSurface& b) {
  EXPECT_EQ(a.coarse.positions_O, b.coarse.positions_O);
  EXPECT_EQ(a.coarse.triangles, b.coarse.triangles);
  EXPECT_EQ(a.triangle_piece, b.triangle_piece);
  EXPECT_EQ(a.triangle_chart, b.triangle_chart);
  EXPECT_EQ(a.piece_thickness_m, b.piece_thickness_m);
  ASSERT_EQ(a.charts.size(), b.charts.size());
  for (std::size_t i = 0; i < a.charts.size(); ++i) {
    EXPECT_EQ(a.charts[i].X_OH, b.charts[i].X_OH);
    EXPECT_EQ(a.charts[i].texel_m, b.charts[i].texel_m);
    EXPECT_EQ(a.charts[i].columns, b.charts[i].columns);
    EXPECT_EQ(a.charts[i].first_tile, b.charts[i].first_tile);
  }
  ASSERT_EQ(a.tiles.size(), b.tiles.size());
  for (std::size_t i = 0; i < a.tiles.size(); ++i) {
    EXPECT_EQ(a.tiles[i].version, b.tiles[i].version);
    EXPECT_EQ(a.tiles[i].coefficients, b.tiles[i].coefficients);
  }
}

HapticSurface read_back(const HapticSurface& surface) {
  return decoded_felt(encoded_felt(surface), counts_of(surface)).value();
}

/// Triangles in any order, turned in any way; vertices, pieces and charts named in any way.
HapticSurface shuffled(const HapticSurface& in, std::mt19937& random) {
  HapticSurface out = in;
  const auto order_of = [&](std::size_t count) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    return order;
  };
  const auto vertex = order_of(in.coarse.positions_O.size()), piece = order_of(in.piece_count),
             triangle = order_of(in.coarse.triangles.size());
  for (std::size_t v = 0; v < vertex.size(); ++v) out.coarse.positions_O[vertex[v]] = in.coarse.positions_O[v];
  for (std::size_t p = 0; p < piece.size(); ++p) out.piece_thickness_m[piece[p]] = in.piece_thickness_m[p];
  for (std::size_t i = 0; i < triangle.size(); ++i) {
    geometry::Triangle t = in.coarse.triangles[triangle[i]];
    std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    for (std::uint32_t& v : t) v = vertex[v];
    out.coarse.triangles[i] = t;
    out.triangle_piece[i] = piece[in.triangle_piece[triangle[i]]];
    out.triangle_chart[i] = in.triangle_chart[triangle[i]];
  }
  return out;
}

TEST(FeltStreamTest, AnySurfaceComesBackExactly) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 6; ++trial) {
    const HapticSurface surface = ball(random, trial % 2 == 0 ? 0 : 0x1p-14);
    expect_same(surface, read_back(surface));
    const HapticSurface other = shuffled(surface, random);
    expect_same(other, read_back(other));
  }
}

/// Most triangles hang on nothing or far back, so that closed edges lie between the open ones.
TEST(FeltStreamTest, ALargeMeshInAnyOrderComesBackToo) {
  std::mt19937 random(7);
  const HapticSurface surface = ball(random, 0, 40, 60);
  for (int trial = 0; trial < 5; ++trial) {
    const HapticSurface other = shuffled(surface, random);
    expect_same(other, read_back(other));
  }
}

TEST(FeltStreamTest, OddMeshesComeBackToo) {
  std::mt19937 random(2);
  HapticSurface surface = ball(random);
  surface.coarse.positions_O.emplace_back(9, 9, 9);           // a vertex that no triangle has
  surface.coarse.triangles[7] = surface.coarse.triangles[3];  // twice the same
  surface.coarse.triangles[11] = {5, 5, 6};                   // no area
  surface.coarse.triangles.pop_back();                        // a hole
  surface.triangle_piece.pop_back(), surface.triangle_chart.pop_back();
  surface.triangle_chart[4] = geometry::kNoChart;
  surface.piece_thickness_m[2] = 0;
  expect_same(surface, read_back(surface));
  surface.charts.clear(), surface.tiles.clear();
  std::fill(surface.triangle_chart.begin(), surface.triangle_chart.end(), geometry::kNoChart);
  expect_same(surface, read_back(surface));
}

TEST(FeltStreamTest, WhatTilesRepeatIsNotTold) {
  std::mt19937 random(3);
  HapticSurface surface = ball(random);
  const std::size_t rough = encoded_felt(surface).size();
  for (geometry::HeightTile& tile : surface.tiles) tile.coefficients.fill(4711), tile.version = 0;
  const std::size_t flat = encoded_felt(surface).size();
  for (geometry::Chart& chart : surface.charts) chart.texel_m *= 2;
  EXPECT_EQ(encoded_felt(surface).size(), flat);
  surface.charts.clear(), surface.tiles.clear();
  std::fill(surface.triangle_chart.begin(), surface.triangle_chart.end(), geometry::kNoChart);
  const std::size_t none = encoded_felt(surface).size();
  EXPECT_LT(flat - none, 6 * (7 * 8 + 8 + 16)) << "six flat charts: their frames, and next to nothing else";
  EXPECT_GT(rough, 5 * flat);
}

TEST(FeltStreamTest, InStoredOrderItIsTheSameSurfaceAndShorter) {
  std::mt19937 random(4);
  const HapticSurface tidy = ball(random, 0x1p-14), untidy = shuffled(tidy, random), stored = stored_order(untidy);
  expect_same(stored, read_back(stored));
  EXPECT_LT(encoded_felt(stored).size() + 400, encoded_felt(untidy).size());
  // Every triangle of one is one of the other, with the same piece's thickness and the same chart.
  const auto corners_of = [](const HapticSurface& of) {
    std::vector<std::array<double, 12>> out;
    for (std::size_t i = 0; i < of.coarse.triangles.size(); ++i) {
      geometry::Triangle t = of.coarse.triangles[i];
      std::rotate(t.begin(),
                  std::min_element(t.begin(), t.end(),
                                   [&](auto a, auto b) {
                                     const glm::dvec3 &p = of.coarse.positions_O[a], &q = of.coarse.positions_O[b];
                                     return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
                                   }),
                  t.end());
      std::array<double, 12> all{};
      for (std::size_t k = 0; k < 9; ++k) all[k] = of.coarse.positions_O[t[k / 3]][static_cast<int>(k % 3)];
      const geometry::Chart& chart = of.charts[of.triangle_chart[i]];
      all[9] = of.piece_thickness_m[of.triangle_piece[i]];
      all[10] = chart.X_OH.p.x;
      all[11] = of.tiles[chart.first_tile].coefficients[17];
      out.push_back(all);
    }
    std::sort(out.begin(), out.end());
    return out;
  };
  EXPECT_EQ(corners_of(untidy), corners_of(stored));
  expect_same(stored_order(stored), stored);  // once is enough
}

TEST(FeltStreamTest, AFrameOnItsGridIsNearAndShort) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-3, 3);
  for (int i = 0; i < 1000; ++i) {
    const spatial::Pose X{spatial::rotation_from_vector({any(random), any(random), any(random)}),
                          {any(random), any(random), any(random)}};
    const spatial::Pose on = frame_on_grid(X, 0x1p-10);
    EXPECT_TRUE(spatial::is_valid(on));
    EXPECT_LT(glm::length(on.p - X.p), 0x1p-10);
    EXPECT_LT(glm::length(spatial::rotate(on, {0, 0, 1}) - spatial::rotate(X, {0, 0, 1})), 0.2);
    EXPECT_EQ(frame_on_grid(on, 0x1p-10), on);
  }
}

TEST(FeltStreamTest, RefusesWhatNoEncoderWrote) {
  std::mt19937 random(6);
  const HapticSurface surface = ball(random, 0x1p-14);
  const std::vector<std::byte> bytes = encoded_felt(surface);
  const FeltCounts counts = counts_of(surface);
  for (std::size_t length = 0; length < bytes.size(); length += 1 + length / 40)
    EXPECT_FALSE(decoded_felt(std::span(bytes).first(length), counts));
  for (std::uint32_t FeltCounts::*of :
       {&FeltCounts::vertices, &FeltCounts::triangles, &FeltCounts::pieces, &FeltCounts::charts, &FeltCounts::tiles}) {
    for (const std::uint32_t other : {0U, counts.*of - 1, counts.*of + 1, kMostFeltTiles}) {
      FeltCounts wrong = counts;
      wrong.*of = other;
      const auto read = decoded_felt(bytes, wrong);
      EXPECT_TRUE(!read || !geometry::faults(*read).empty() || of == &FeltCounts::vertices ||
                  of == &FeltCounts::pieces);
    }
  }
  const FeltCounts most{kMostFeltElements, kMostFeltElements, kMostFeltElements, kMostFeltElements, kMostFeltTiles};
  EXPECT_FALSE(decoded_felt(std::vector<std::byte>(4), most)) << "a claim takes no memory";
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> spoilt = bytes;
    spoilt[random() % spoilt.size()] ^= static_cast<std::byte>(1 + random() % 255);
    (void)decoded_felt(spoilt, counts);
  }
}

}  // namespace
}  // namespace farfeel::codecs
