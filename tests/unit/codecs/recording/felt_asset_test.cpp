#include "codecs/recording/felt_asset.h"

#include <gtest/gtest.h>

#include "tests/support/tiled_plates.h"

namespace farfeel::codecs {
namespace {

std::vector<std::byte> plates_as_asset(const test_support::TiledPlates& plates) {
  const penetration::FeltSurface tool(plates.tool), table(plates.table);
  const std::array bodies{
      contact_service::TouchableObject{.felt = &plates.tool, .material = plates.material, .prepared = &tool},
      contact_service::TouchableObject{.felt = &plates.table, .material = plates.material, .prepared = &table}};
  return write_felt_asset(bodies, {}).value();
}

TEST(FeltAsset, HasTheOutlineAndEveryHeightExactly) {
  const test_support::TiledPlates plates;
  const auto asset = read_felt_asset(plates_as_asset(plates));
  ASSERT_TRUE(asset) << asset.error();
  EXPECT_TRUE(read_felt_outline(asset->outline));
  ASSERT_EQ(asset->scene.bodies.size(), 2);
  for (std::uint32_t surface = 0; surface < 2; ++surface) {
    const std::vector<geometry::HeightTile>& tiles = asset->scene.bodies[surface].surface.tiles;
    ASSERT_GT(tiles.size(), 0);
    for (std::uint32_t i = 0; i < tiles.size(); ++i)
      EXPECT_EQ(tiles[i].coefficients, plates.tile({surface, i}).coefficients);
  }
}

TEST(FeltAsset, CutOrLengthenedIsRefused) {
  std::vector<std::byte> bytes = plates_as_asset({});
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 8)
    EXPECT_FALSE(read_felt_asset(std::span(bytes).first(size))) << size;
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(read_felt_asset(bytes));
}

}  // namespace
}  // namespace farfeel::codecs
