#include "codecs/tile/tile_codec.h"

#include <gtest/gtest.h>

#include <random>

#include "slave_sim/models/height_plate.h"

namespace farfeel::codecs {
namespace {

geometry::HeightTile noise_tile(std::uint32_t amplitude, std::uint32_t version = 7) {
  std::mt19937 random(amplitude);
  geometry::HeightTile tile{.version = version, .coefficients = {}};
  for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(30'000 + random() % (amplitude + 1));
  return tile;
}

void expect_round_trip(const geometry::HeightTile& tile, std::size_t parts) {
  const auto encoded = encoded_tile(42, tile);
  EXPECT_EQ(encoded.size(), parts);
  TileAssembly assembly;
  bool is_complete = false;
  for (const auto& bytes : encoded) {
    EXPECT_LE(bytes.size(), kMostPartBytes);
    const auto part = decoded_tile_part(bytes);
    ASSERT_TRUE(part) << part.error();
    EXPECT_EQ(part->tile, 42U);
    EXPECT_FALSE(is_complete);
    is_complete = assembly.add(*part);
  }
  EXPECT_TRUE(is_complete);
  EXPECT_EQ(assembly.tile().version, tile.version);
  EXPECT_EQ(assembly.tile().coefficients, tile.coefficients);
}

TEST(TileCodecTest, RoundTripsFromFlatToNoise) {
  expect_round_trip({}, 1);
  expect_round_trip(noise_tile(3), 1);
  expect_round_trip(noise_tile(40'000), 2);  // hardly compresses: two raw halves
  geometry::HeightTile extremes;
  for (std::size_t i = 0; i < extremes.coefficients.size(); ++i) extremes.coefficients[i] = i % 3 == 0 ? 65535 : 0;
  expect_round_trip(extremes, 1);
}

TEST(TileCodecTest, RealTexturesAreOneDatagramATile) {
  const geometry::HapticSurface plate = slave_sim::ridged_plate(0.003, 0.0005);
  std::size_t bytes = 0;
  for (std::uint32_t i = 0; i < plate.tiles.size(); ++i) {
    const auto parts = encoded_tile(i, plate.tiles[i]);
    EXPECT_EQ(parts.size(), 1U);
    bytes += parts[0].size();
  }
  EXPECT_LT(bytes, plate.tiles.size() * 700);  // of 2,048 raw
}

TEST(TileCodecTest, TheNewestVersionWinsInAnyOrder) {
  const auto part = [](const geometry::HeightTile& tile, std::size_t n) {
    return *decoded_tile_part(encoded_tile(0, tile)[n]);
  };
  const geometry::HeightTile old = noise_tile(40'000, 5), fresh = noise_tile(40'001, 6);
  TileAssembly assembly;
  EXPECT_FALSE(assembly.add(part(old, 0)));
  EXPECT_FALSE(assembly.add(part(fresh, 1)));  // starts again with the newer one
  EXPECT_FALSE(assembly.add(part(old, 1)));    // too old by now
  EXPECT_TRUE(assembly.add(part(fresh, 0)));
  EXPECT_EQ(assembly.tile().coefficients, fresh.coefficients);
  EXPECT_FALSE(assembly.add(part(fresh, 0)));  // a copy
  EXPECT_FALSE(assembly.add(part(old, 0)));
  EXPECT_EQ(assembly.tile().version, 6U);
}

TEST(TileCodecTest, RefusesTruncatedLongAndBentBytes) {
  const auto whole = encoded_tile(1, noise_tile(3))[0], half = encoded_tile(1, noise_tile(40'000))[0];
  for (const auto& bytes : {whole, half}) {
    for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decoded_tile_part(std::span(bytes).first(n))) << n;
    std::vector<std::byte> longer = bytes;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decoded_tile_part(longer));
    for (std::size_t n = 0; n < 4; ++n) {
      std::vector<std::byte> bent = bytes;
      bent[n] = std::byte{77};
      EXPECT_FALSE(decoded_tile_part(bent)) << n;
    }
  }
}

}  // namespace
}  // namespace farfeel::codecs
