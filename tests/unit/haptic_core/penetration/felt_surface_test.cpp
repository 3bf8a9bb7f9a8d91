// What a surface that takes over other tiles says of them.
#include "haptic_core/penetration/felt_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/plates.h"

namespace farfeel::penetration {
namespace {

// A search leaves out what the relief says cannot touch: a peak above it would be a peak that nobody feels.
TEST(FeltSurfaceTest, AChangedTileWidensTheReliefOverItsTriangles) {
  const auto flat = [](double, double) { return 0.0; };
  const auto hills = [](double x, double) { return 0.2e-3 * std::cos(2e3 * x); };
  geometry::HapticSurface surface = support::textured_plate({}, flat);
  const geometry::HapticSurface changed = support::textured_plate({}, hills);
  surface.scale = changed.scale;
  for (std::uint32_t i = 0; i < surface.tiles.size(); ++i) {
    const auto level =
        static_cast<std::uint16_t>(std::lround((0.0 - changed.scale.height_m(0)) / changed.scale.scale_m));
    std::fill(surface.tiles[i].coefficients.begin(), surface.tiles[i].coefficients.end(), level);
  }
  FeltSurface felt(surface);
  ASSERT_LT(felt.relief(0).high_m, 0.05e-3);
  for (std::uint32_t i = 0; i < surface.tiles.size(); ++i) {
    surface.tiles[i] = changed.tiles[i];
    surface.tiles[i].version = 1;
    felt.take_tile(i);
  }
  for (std::uint32_t triangle = 0; triangle < 2; ++triangle) {
    EXPECT_GE(felt.relief(triangle).high_m, 0.19e-3);
    EXPECT_LE(felt.relief(triangle).low_m, -0.19e-3);
  }
}

}  // namespace
}  // namespace farfeel::penetration
