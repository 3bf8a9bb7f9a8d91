#include "haptic_core/penetration/height_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/penetration/felt_surface.h"
#include "tests/support/plates.h"

namespace farfeel::penetration {
namespace {

double greatest_bend(const geometry::HeightSample& h) {
  return 0.5 * (h.h_ss_1_per_m + h.h_tt_1_per_m) + std::hypot(0.5 * (h.h_ss_1_per_m - h.h_tt_1_per_m), h.h_st_1_per_m);
}

/// Rough enough that every texel differs from its neighbours: no point of any square exceeds what is said of it.
TEST(HeightBounds, NothingInTheSquareExceedsThem) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto surface = support::textured_plate({.width_m = 3e-3, .depth_m = 2e-3, .texel_m = 0.1e-3},
                                               [&](double, double) { return 0.1e-3 * unit(random); });
  const FeltSurface felt(surface);
  const geometry::Chart& chart = surface.charts[0];
  const double bend_scale = kBendUnit * surface.scale.scale_m / (chart.texel_m * chart.texel_m);
  for (std::uint32_t k = 0; k < kBoundsLevels; ++k) {
    const BoundsLevel level = felt.bounds(0).level(k);
    const double reach = 1u << k;  // texels
    for (int trial = 0; trial < 2000; ++trial) {
      const double s = unit(random) * chart.columns, t = unit(random) * chart.rows;
      const auto i = static_cast<std::uint32_t>(s / reach), j = static_cast<std::uint32_t>(t / reach);
      ASSERT_LT(i, level.columns);
      ASSERT_LT(j, level.rows);
      const std::uint32_t entry = level.entries[j * level.columns + i];
      const auto sample = geometry::sample_height(surface, chart, chart.texel_m * (s + reach * (2 * unit(random) - 1)),
                                                  chart.texel_m * (t + reach * (2 * unit(random) - 1)));
      EXPECT_LE(sample.h_m, surface.scale.height_m(static_cast<std::uint16_t>(entry & 0xFFFF)) + 1e-12);
      EXPECT_LE(greatest_bend(sample), bend_scale * (entry >> 16) * (1 + 1e-12));
    }
  }
}

TEST(HeightBounds, TheCoarsestKnowsTheHighestCoefficientOnly) {
  const std::vector<std::uint16_t> coefficients(9, 1000);
  const HeightBounds flat(coefficients.data(), 1, 1);
  for (std::uint32_t k = 0; k < kBoundsLevels; ++k) EXPECT_EQ(flat.level(k).entries[0], 1000u);
}

}  // namespace
}  // namespace farfeel::penetration
