#include "codecs/tile/coarse_level.h"

#include <gtest/gtest.h>

#include <random>

#include "slave_sim/models/height_plate.h"

namespace farfeel::codecs {
namespace {

using geometry::CoarseHeights;
using geometry::HapticSurface;

HapticSurface some_charts() {
  HapticSurface surface = slave_sim::ridged_plate(3e-3, 0.3e-3);
  const std::array<glm::uvec2, 4> sizes{{{31, 2}, {1, 1}, {95, 61}, {10, 300}}};
  surface.charts.resize(sizes.size(), surface.charts[0]);
  std::uint32_t tiles = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    geometry::Chart& chart = surface.charts[i];
    chart.columns = sizes[i].x, chart.rows = sizes[i].y, chart.first_tile = tiles;
    tiles += chart.tiles_across() * chart.tiles_down();
  }
  surface.tiles.resize(tiles);
  return surface;
}

CoarseHeights any_level(const HapticSurface& surface, std::uint32_t most, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> any(0, most);
  CoarseHeights level;
  level.values.resize(geometry::blocks_of(surface));
  level.off.resize(surface.tiles.size());
  for (auto* numbers : {&level.values, &level.off})
    for (std::uint16_t& number : *numbers) number = static_cast<std::uint16_t>(any(random));
  return level;
}

TEST(CoarseLevel, ComesBackAsItWas) {
  const HapticSurface surface = some_charts();
  for (const std::uint32_t most : {0u, 3u, 500u, 0xFFFFu}) {
    const CoarseHeights level = any_level(surface, most, most + 1);
    const auto bytes = encoded_coarse_level(surface, level);
    const auto read = decoded_coarse_level(surface, bytes);
    ASSERT_TRUE(read) << most;
    EXPECT_EQ(read->values, level.values);
    EXPECT_EQ(read->off, level.off);
    if (most == 0) {
      EXPECT_LT(bytes.size(), 20u);
    }
  }
}

TEST(CoarseLevel, IsAFewBytesATile) {
  const HapticSurface plate = slave_sim::ridged_plate(3e-3, 0.3e-3);
  EXPECT_LT(encoded_coarse_level(plate, geometry::coarse_heights(plate)).size(), 12 * plate.tiles.size());
}

TEST(CoarseLevel, BytesThatNoEncoderWroteAreRefused) {
  const HapticSurface surface = some_charts();
  auto bytes = encoded_coarse_level(surface, any_level(surface, 200, 7));
  for (std::size_t cut = 0; cut < bytes.size(); ++cut)
    EXPECT_FALSE(decoded_coarse_level(surface, std::span(bytes).first(cut))) << cut;
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(decoded_coarse_level(surface, bytes));
  std::mt19937 random(5);
  for (int n = 0; n < 200; ++n) {
    std::vector<std::byte> noise(random() % 600);
    for (std::byte& byte : noise) byte = static_cast<std::byte>(random());
    (void)decoded_coarse_level(surface, noise);  // refused or not: within its bounds
  }
}

}  // namespace
}  // namespace farfeel::codecs
