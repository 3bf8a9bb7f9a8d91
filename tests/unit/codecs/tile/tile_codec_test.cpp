#include "codecs/tile/tile_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "slave_sim/models/height_plate.h"

namespace farfeel::codecs {
namespace {

using geometry::HeightTile;

constexpr std::array<Nearness, 10> kBounds{
    {{0, 0}, {1, 2}, {2, 1}, {10, 20}, {10, 3}, {109, 218}, {109, 50}, {109, 0}, {5000, 9000}, {65535, 65535}}};
constexpr Nearness kWithin9{9, 18};

HeightTile noise_tile(std::uint32_t amplitude, std::uint32_t version = 7) {
  std::mt19937 random(amplitude);
  HeightTile tile{.version = version, .coefficients = {}};
  for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(30'000 + random() % (amplitude + 1));
  return tile;
}

template <typename Value>
HeightTile tile_of(Value&& value) {
  HeightTile tile;
  for (std::uint32_t i = 0; i < tile.coefficients.size(); ++i)
    tile.coefficients[i] = static_cast<std::uint16_t>(
        std::clamp<double>(value(i % geometry::kTileSide, i / geometry::kTileSide), 0, 65535));
  return tile;
}

/// Every kind of relief that there may be, and some that nobody would call one.
std::vector<HeightTile> hard_tiles() {
  std::vector<HeightTile> tiles{{}, noise_tile(1), noise_tile(3), noise_tile(400), noise_tile(35'535)};
  for (const double level : {1.0, 32768.0, 65535.0}) tiles.push_back(tile_of([=](double, double) { return level; }));
  tiles.push_back(tile_of([](double x, double) { return x < 13 ? 0 : 65535; }));
  tiles.push_back(tile_of([](double x, double y) { return std::fmod(x + y, 2) < 1 ? 0 : 65535; }));
  tiles.push_back(tile_of([](double x, double y) { return x == 31 && y == 31 ? 65535 : 0; }));
  tiles.push_back(tile_of([](double x, double y) { return 65535 - (x == 0 && y == 0 ? 65535 : 0); }));
  tiles.push_back(tile_of([](double x, double y) { return 2114.0 * (x + y) / 2; }));
  for (const double wave : {3.0, 7.0, 20.0, 200.0}) {
    tiles.push_back(tile_of([=](double x, double y) { return 30'000 + 9000 * std::sin((x + 0.7 * y) / wave); }));
    tiles.push_back(tile_of([=](double x, double) { return 40'000 * std::abs(std::sin(x / wave)); }));
  }
  std::mt19937 random(5);
  for (int n = 0; n < 20; ++n) {  // smooth, rough and stepped at once, of any size
    const auto any = [&](int end) { return std::uniform_int_distribution(0, end - 1)(random); };
    const double waves = 0.05 + 0.1 * any(10), high = 1 << any(16), rough = 1 << any(10), edge = any(40);
    tiles.push_back(tile_of([&](double x, double y) {
      return 20'000 + high * std::sin(waves * x) * std::cos(waves * y) + rough * any(100) / 100.0 +
             (x > edge ? 3000 : 0);
    }));
  }
  return tiles;
}

std::size_t bytes_of(const std::vector<std::vector<std::byte>>& parts) {
  std::size_t bytes = 0;
  for (const auto& part : parts) bytes += part.size();
  return bytes;
}

HeightTile round_trip(const HeightTile& tile, const Nearness& within, std::size_t worth_bytes = 0) {
  TileAssembly assembly;
  bool is_complete = false;
  for (const auto& bytes : encoded_tile(42, tile, within, worth_bytes)) {
    EXPECT_LE(bytes.size(), kMostPartBytes);
    const auto part = decoded_tile_part(bytes);
    EXPECT_TRUE(part) << part.error();
    if (!part) return {};
    EXPECT_EQ(part->tile, 42U);
    EXPECT_FALSE(is_complete);
    is_complete = assembly.add(*part);
  }
  EXPECT_TRUE(is_complete);
  EXPECT_EQ(assembly.tile().version, tile.version);
  return assembly.tile();
}

void expect_near(const HeightTile& read, const HeightTile& written, const Nearness& within) {
  const auto off = [&](std::size_t i) { return read.coefficients[i] - written.coefficients[i]; };
  int most = 0, most_difference = 0;
  for (std::size_t i = 0; i < read.coefficients.size(); ++i) {
    most = std::max(most, std::abs(off(i)));
    if (i % geometry::kTileSide != 0) most_difference = std::max(most_difference, std::abs(off(i) - off(i - 1)));
    if (i >= geometry::kTileSide)
      most_difference = std::max(most_difference, std::abs(off(i) - off(i - geometry::kTileSide)));
  }
  EXPECT_LE(most, within.coefficients);
  EXPECT_LE(most_difference, within.differences);
}

TEST(TileCodecTest, EveryTileIsReadAsNearAsStated) {
  const std::vector<HeightTile> tiles = hard_tiles();
  for (std::size_t n = 0; n < tiles.size(); ++n) {
    for (const Nearness& within : kBounds) {
      SCOPED_TRACE(testing::Message() << n << " within " << within.coefficients << ", " << within.differences);
      expect_near(round_trip(tiles[n], within), tiles[n], within);
    }
  }
}

TEST(TileCodecTest, ExactlyItIsTheTile) {
  for (const HeightTile& tile : hard_tiles()) EXPECT_EQ(round_trip(tile, kExactly).coefficients, tile.coefficients);
}

TEST(TileCodecTest, WhatIsWorthItMakesATileFinerAndKeepsTheBound) {
  const std::vector<HeightTile> tiles = hard_tiles();
  for (std::size_t n = 0; n < tiles.size(); ++n) {
    for (const Nearness& within : kBounds) {
      const std::size_t shortest = bytes_of(encoded_tile(1, tiles[n], within));
      for (const std::size_t worth : {1, 60, 150, 390, 1100, 5000}) {
        SCOPED_TRACE(testing::Message() << n << " within " << within.coefficients << ", " << within.differences
                                        << ", worth " << worth);
        const std::size_t bytes = bytes_of(encoded_tile(1, tiles[n], within, worth));
        EXPECT_LE(bytes, std::max(shortest, worth));
        expect_near(round_trip(tiles[n], within, worth), tiles[n], within);
      }
    }
  }
  for (const HeightTile& tile : {HeightTile{}, noise_tile(1), noise_tile(3)})
    EXPECT_EQ(round_trip(tile, {109, 218}, 390).coefficients, tile.coefficients);
}

TEST(TileCodecTest, ASmoothTileIsAsFineAsItsBytesAllow) {
  const HeightTile tile = tile_of([](double x, double y) {
    return 30'000 + 9000 * std::sin((x + 0.7 * y) / 3) + 4000 * std::cos((0.3 * x - y) / 2.5);
  });
  const auto rms_off = [&](std::size_t worth) {
    const HeightTile read = round_trip(tile, {400, 800}, worth);
    double squares = 0;
    for (std::size_t i = 0; i < read.coefficients.size(); ++i)
      squares += std::pow(read.coefficients[i] - tile.coefficients[i], 2);
    return std::sqrt(squares / static_cast<double>(read.coefficients.size()));
  };
  EXPECT_GT(bytes_of(encoded_tile(1, tile, {400, 800}, 390)), 350U);
  EXPECT_LT(rms_off(390), 0.5 * rms_off(250));
  EXPECT_LT(rms_off(250), 0.5 * rms_off(0));
}

TEST(TileCodecTest, WhatIsReadAndSentOnStaysWithinTheFirstBound) {
  for (const HeightTile& tile : hard_tiles()) {
    const HeightTile once = round_trip(tile, kWithin9), exactly = round_trip(once, kExactly);
    EXPECT_EQ(exactly.coefficients, once.coefficients);
  }
}

TEST(TileCodecTest, EveryFormFitsItsPartsWhateverTheTile) {
  EXPECT_EQ(encoded_tile(1, noise_tile(3), kExactly).size(), 1U);
  const auto raw = encoded_tile(1, noise_tile(65'535), kExactly);  // as noise is not shorter than itself
  ASSERT_EQ(raw.size(), 2U);
  EXPECT_EQ(raw[0].size(), kTilePartHeaderBytes + 1024);
  EXPECT_EQ(raw[0][0], std::byte{2});
  EXPECT_EQ(encoded_tile(1, noise_tile(3), kExactly)[0][0], std::byte{3});
  EXPECT_EQ(encoded_tile(1, tile_of([](double x, double y) { return 30'000 + 9000 * std::sin((x + y) / 5); }),
                         kWithin9)[0][0],
            std::byte{4});
}

TEST(TileCodecTest, HeightsAndSlopesAreAsNearAsStated) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(0, 0.035);
  for (const double rough_m : {0.0, 2e-6}) {
    const geometry::HapticSurface plate = slave_sim::height_plate([&](double x, double y) {
      return 40e-6 * std::sin(4000 * x) * std::cos(3000 * y) + rough_m * (any(random) / 0.035 - 0.5);
    });
    geometry::HapticSurface read = plate;
    EXPECT_GT(nearness(plate).coefficients, 0);
    for (HeightTile& tile : read.tiles) tile = round_trip(tile, nearness(plate));
    double most_m = 0, most_slope = 0;
    for (int n = 0; n < 20'000; ++n) {
      const double s_m = any(random), t_m = any(random);
      const geometry::HeightSample a = geometry::sample_height(read, read.charts[0], s_m, t_m);
      const geometry::HeightSample b = geometry::sample_height(plate, plate.charts[0], s_m, t_m);
      most_m = std::max(most_m, std::abs(a.h_m - b.h_m));
      most_slope = std::max({most_slope, std::abs(a.h_s - b.h_s), std::abs(a.h_t - b.h_t)});
    }
    EXPECT_LE(most_m, kHeightsWithin_m);
    EXPECT_LE(most_slope, kSlopesWithin);
    EXPECT_GT(most_m, 0.05 * kHeightsWithin_m);
  }
}

TEST(TileCodecTest, SmoothReliefTakesAFractionOfABitATexel) {
  const auto relief = [](double x, double y) { return 40e-6 * std::sin(4000 * x) * std::cos(3000 * y); };
  const geometry::HapticSurface plate = slave_sim::height_plate(relief);
  std::size_t bytes = 0;
  for (std::uint32_t i = 0; i < plate.tiles.size(); ++i) {
    const auto parts = encoded_tile(i, plate.tiles[i], nearness(plate));
    EXPECT_EQ(parts.size(), 1U);
    bytes += parts[0].size();
  }
  EXPECT_LT(bytes, plate.tiles.size() * 200);  // of 2,048 raw
}

TEST(TileCodecTest, TheNewestVersionWinsInAnyOrder) {
  const auto part = [](const HeightTile& tile, std::size_t n) {
    return *decoded_tile_part(encoded_tile(0, tile, kExactly)[n]);
  };
  const HeightTile old = noise_tile(40'000, 5), fresh = noise_tile(40'001, 6);
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
  const HeightTile smooth = tile_of([](double x, double y) { return 30'000 + 9000 * std::sin((x + y) / 5); });
  for (const auto& bytes :
       {encoded_tile(1, noise_tile(3), kExactly)[0], encoded_tile(1, noise_tile(65'535), kExactly)[0],
        encoded_tile(1, noise_tile(5000), kWithin9)[0], encoded_tile(1, smooth, kWithin9)[0]}) {
    EXPECT_TRUE(decoded_tile_part(bytes));
    for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decoded_tile_part(std::span(bytes).first(n))) << n;
    std::vector<std::byte> longer = bytes;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decoded_tile_part(longer));
    for (const std::size_t n : {0, 1}) {
      for (const int other : {0, 1, 3, 5, 77, 255}) {
        std::vector<std::byte> bent = bytes;
        bent[n] = static_cast<std::byte>(other);
        EXPECT_EQ(decoded_tile_part(bent).has_value(), bent == bytes) << n << " " << other;
      }
    }
  }
}

/// A range coder's bytes that end otherwise than an encoder's do are refused: nearly every change makes them so.
TEST(TileCodecTest, RefusesMostBentPayloadsAndBoundsTheRest) {
  std::mt19937 random(3);
  int accepted = 0;
  for (const Nearness& within : {kExactly, kWithin9}) {
    const auto bytes = encoded_tile(1, noise_tile(3000), within)[0];
    for (int n = 0; n < 2000; ++n) {
      std::vector<std::byte> bent = bytes;
      bent[kTilePartHeaderBytes + random() % (bent.size() - kTilePartHeaderBytes)] ^=
          static_cast<std::byte>(1 + random() % 255);
      accepted += decoded_tile_part(bent).has_value();
    }
  }
  EXPECT_LT(accepted, 40);
}

}  // namespace
}  // namespace farfeel::codecs
