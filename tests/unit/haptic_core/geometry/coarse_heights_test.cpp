#include "haptic_core/geometry/coarse_heights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slave_sim/models/height_plate.h"

namespace farfeel::geometry {
namespace {

HapticSurface plate(const std::function<double(double, double)>& height_m) {
  HapticSurface surface = slave_sim::ridged_plate(3e-3, 0.3e-3);
  surface.scale = {-2e-3, 0.1e-6};
  for (const Chart& chart : surface.charts) {
    for (std::uint32_t tile = 0; tile < chart.tiles_across() * chart.tiles_down(); ++tile) {
      const std::uint32_t i = tile % chart.tiles_across() * kTileTexels, j = tile / chart.tiles_across() * kTileTexels;
      for (std::uint32_t row = 0; row < kTileSide; ++row) {
        for (std::uint32_t column = 0; column < kTileSide; ++column) {
          const double x_m = chart.texel_m * (i + column - 0.5), y_m = chart.texel_m * (j + row - 0.5);
          surface.tiles[chart.first_tile + tile].coefficients[row * kTileSide + column] = static_cast<std::uint16_t>(
              std::lround((height_m(x_m, y_m) - surface.scale.offset_m) / surface.scale.scale_m));
        }
      }
    }
  }
  return surface;
}

double step_m(const HapticSurface& surface) {
  return coarse_step(surface.scale) * surface.scale.scale_m;
}

/// Greatest difference of heights at random places of a tile's texels, tile by tile: told must not be less.
void expect_bounded(const HapticSurface& truth, const CoarseHeights& level) {
  HapticSurface made = truth;
  stand_in(made, level);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  for (const Chart& chart : truth.charts) {
    for (int n = 0; n < 20'000; ++n) {
      const double s_m = share(random) * chart.columns * chart.texel_m,
                   t_m = share(random) * chart.rows * chart.texel_m;
      const auto i = std::min(static_cast<std::uint32_t>(s_m / chart.texel_m), chart.columns - 1) / kTileTexels;
      const auto j = std::min(static_cast<std::uint32_t>(t_m / chart.texel_m), chart.rows - 1) / kTileTexels;
      const double off_m =
          std::abs(sample_height(made, chart, s_m, t_m).h_m - sample_height(truth, chart, s_m, t_m).h_m);
      ASSERT_LE(off_m, step_m(truth) * level.off[chart.first_tile + j * chart.tiles_across() + i] + 1e-12);
    }
  }
}

TEST(CoarseHeights, ADomeIsThereToWithinAStep) {
  const HapticSurface dome = plate([](double x_m, double y_m) { return 1e-3 - 0.5 * (x_m * x_m + y_m * y_m); });
  const CoarseHeights level = coarse_heights(dome);
  EXPECT_EQ(level.values.size(), blocks_of(dome));
  for (const std::uint16_t off : level.off) EXPECT_LE(off, 2);
  expect_bounded(dome, level);
}

TEST(CoarseHeights, WhatIsFinerThanABlockIsInTheBound) {
  const double texel_m = plate([](double, double) { return 0.0; }).charts[0].texel_m;
  const double amplitude_m = 50e-6;
  const HapticSurface ridges =
      plate([&](double x_m, double y_m) { return 0.1 * y_m + amplitude_m * std::sin(2 * M_PI * x_m / (5 * texel_m)); });
  const CoarseHeights level = coarse_heights(ridges);
  expect_bounded(ridges, level);
  for (const std::uint16_t off : level.off) {
    EXPECT_GE(off * step_m(ridges), 0.9 * amplitude_m);
    EXPECT_LE(off * step_m(ridges), 1.3 * amplitude_m) << "and little more: the slope is not lost";
  }
}

TEST(CoarseHeights, AnythingIsBounded) {
  std::mt19937 random(2);
  HapticSurface noise = plate([](double, double) { return 0.0; });
  // Neighbours repeat each other's borders: random coefficients by place, not by tile.
  std::uniform_int_distribution<std::uint32_t> any(0, 0xFFFF);
  std::vector<std::uint16_t> field(1 << 20);
  for (std::uint16_t& value : field) value = static_cast<std::uint16_t>(any(random));
  for (const Chart& chart : noise.charts) {
    for (std::uint32_t tile = 0; tile < chart.tiles_across() * chart.tiles_down(); ++tile) {
      const std::uint32_t i = tile % chart.tiles_across() * kTileTexels, j = tile / chart.tiles_across() * kTileTexels;
      for (std::uint32_t k = 0; k < kTileSide * kTileSide; ++k)
        noise.tiles[chart.first_tile + tile].coefficients[k] =
            field[((j + k / kTileSide) * 1021 + i + k % kTileSide) % field.size()];
    }
  }
  expect_bounded(noise, coarse_heights(noise));
}

TEST(CoarseHeights, ABoundThatWasWidenedHoldsForEveryVersion) {
  const HapticSurface first = plate([](double x_m, double y_m) { return 1e-3 - 0.5 * (x_m * x_m + y_m * y_m); });
  HapticSurface second = first;
  CoarseHeights level = coarse_heights(first);
  for (std::uint32_t tile = 0; tile < second.tiles.size(); ++tile) {
    for (std::uint16_t& c : second.tiles[tile].coefficients) c = static_cast<std::uint16_t>(c / 2);
    widen_bound(level, first, tile, second.tiles[tile]);
  }
  EXPECT_EQ(level.values, coarse_heights(first).values);
  expect_bounded(first, level);
  expect_bounded(second, level);
}

TEST(CoarseHeights, WhatStandsInIsContinuousAcrossTiles) {
  HapticSurface made = plate([](double x_m, double y_m) { return 1e-4 * std::sin(900 * x_m) * std::cos(700 * y_m); });
  stand_in(made, coarse_heights(made));
  const Chart& chart = made.charts[0];
  ASSERT_GT(chart.tiles_across(), 1u);
  for (std::uint32_t row = 0; row < kTileSide; ++row) {
    EXPECT_EQ(made.tiles[0].at(kTileSide - 2, row), made.tiles[1].at(0, row));
    EXPECT_EQ(made.tiles[0].at(kTileSide - 1, row), made.tiles[1].at(1, row));
  }
}

}  // namespace
}  // namespace farfeel::geometry
