#include "haptic_core/geometry/height_field_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "slave_sim/models/height_plate.h"

namespace farfeel::geometry {
namespace {

SampledChart random_chart(std::uint32_t columns, std::uint32_t rows, std::mt19937& random) {
  std::uniform_real_distribution<double> height(-1e-3, 1e-3);
  SampledChart chart{.X_OH = {}, .texel_m = 2e-4, .columns = columns, .rows = rows, .heights_m = {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) chart.heights_m.push_back(height(random));
  return chart;
}

TEST(HeightFieldFitTest, InterpolatesEverySampleWithinTheScalesRounding) {
  std::mt19937 random(5);
  std::vector<SampledChart> charts;
  for (const auto& [columns, rows] : {std::pair{1, 1}, {1, 7}, {2, 2}, {3, 40}, {30, 30}, {31, 61}, {95, 64}}) {
    charts.push_back(random_chart(columns, rows, random));
  }
  HapticSurface surface;
  set_height_fields(surface, charts);
  ASSERT_EQ(surface.charts.size(), charts.size());
  EXPECT_TRUE(faults(surface).empty());
  for (std::size_t n = 0; n < charts.size(); ++n) {
    for (std::uint32_t j = 0; j < charts[n].rows; ++j) {
      for (std::uint32_t i = 0; i < charts[n].columns; ++i) {
        const HeightSample h = sample_height(surface, surface.charts[n], (i + 0.5) * 2e-4, (j + 0.5) * 2e-4);
        EXPECT_NEAR(h.h_m, charts[n].heights_m[j * charts[n].columns + i], 0.51 * surface.scale.scale_m);
      }
    }
  }
}

TEST(HeightFieldFitTest, ReproducesMeansOverTexels) {
  std::mt19937 random(8);
  SampledChart chart = random_chart(33, 20, random);
  chart.are_means = true;
  HapticSurface surface;
  set_height_fields(surface, {&chart, 1});
  for (std::uint32_t j = 1; j + 1 < chart.rows; ++j) {
    for (std::uint32_t i = 1; i + 1 < chart.columns; ++i) {
      double mean = 0;  // Simpson's rule is exact for parabolas
      for (const auto& [u, wu] : {std::pair{0.0, 1.0}, {0.5, 4.0}, {1.0, 1.0}}) {
        for (const auto& [v, wv] : {std::pair{0.0, 1.0}, {0.5, 4.0}, {1.0, 1.0}}) {
          mean += wu * wv / 36 * sample_height(surface, surface.charts[0], (i + u) * 2e-4, (j + v) * 2e-4).h_m;
        }
      }
      EXPECT_NEAR(mean, chart.heights_m[j * chart.columns + i], 0.51 * surface.scale.scale_m);
    }
  }
}

TEST(HeightFieldFitTest, HeightAndSlopeAreContinuousAcrossTexelsAndTiles) {
  std::mt19937 random(6);
  const SampledChart chart = random_chart(64, 33, random);
  HapticSurface surface;
  set_height_fields(surface, {&chart, 1});
  for (std::uint32_t i = 1; i < chart.columns; ++i) {
    const double border = i * chart.texel_m, t = 31.3 * chart.texel_m, step = 1e-12;
    const HeightSample before = sample_height(surface, surface.charts[0], border - step, t);
    const HeightSample after = sample_height(surface, surface.charts[0], border + step, t);
    EXPECT_NEAR(before.h_m, after.h_m, 1e-10);
    EXPECT_NEAR(before.h_s, after.h_s, 1e-6);
    EXPECT_NEAR(before.h_t, after.h_t, 1e-6);
  }
}

TEST(HeightFieldFitTest, SlopesAndCurvaturesAreTheHeightsDerivatives) {
  std::mt19937 random(7);
  const SampledChart chart = random_chart(40, 40, random);
  HapticSurface surface;
  set_height_fields(surface, {&chart, 1});
  std::uniform_real_distribution<double> where(0.001, 0.007);
  const auto at = [&](double s, double t) { return sample_height(surface, surface.charts[0], s, t); };
  for (int i = 0; i < 1000; ++i) {
    const double s = where(random), t = where(random), step = 1e-8;
    EXPECT_NEAR(at(s, t).h_s, (at(s + step, t).h_m - at(s - step, t).h_m) / (2 * step), 1e-3);
    EXPECT_NEAR(at(s, t).h_t, (at(s, t + step).h_m - at(s, t - step).h_m) / (2 * step), 1e-3);
  }
}

TEST(HeightFieldFitTest, ARidgedPlateIsItsClosedForm) {
  const HapticSurface plate = slave_sim::ridged_plate(0.003, 0.0005);
  EXPECT_TRUE(faults(plate).empty());
  EXPECT_TRUE(is_closed_and_oriented(plate.coarse));
  const Chart& chart = plate.charts[0];
  for (double x = -0.019; x < 0.019; x += 0.000137) {
    const HeightSample h = sample_height(plate, chart, x - chart.X_OH.p.x, 0.004 - chart.X_OH.p.y);
    const double angle = 2 * std::numbers::pi * x / 0.003;
    EXPECT_NEAR(h.h_m, 0.00025 * (std::cos(angle) - 1), 3e-7);
    EXPECT_NEAR(h.h_s, -0.00025 * 2 * std::numbers::pi / 0.003 * std::sin(angle), 3e-3);
  }
}

}  // namespace
}  // namespace farfeel::geometry
