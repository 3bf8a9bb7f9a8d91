#include "tests/bench/felt_bytes.h"

#include <gtest/gtest.h>

#include "slave_sim/bake/bake.h"
#include "slave_sim/models/models.h"

namespace farfeel::bench {
namespace {

TEST(FeltBytes, ColoursAreNotFelt) {
  codecs::Asset asset =
      slave_sim::bake_asset("block", slave_sim::block_base(), {.coarse_triangles = 16, .texture = 64})->asset;
  const auto plain = codecs::write_asset(asset).value();
  asset.visible_colours.assign(asset.visible.positions_O.size(), {200, 100, 50});
  const auto coloured = codecs::write_asset(asset).value();
  constexpr std::size_t kDigits = 8;  // of where the stream is
  ASSERT_GT(coloured.size(), plain.size() + 3 * kDigits);
  EXPECT_LE(felt_bytes(coloured), felt_bytes(plain) + kDigits);
  EXPECT_GT(felt_bytes(plain), 500U);
  EXPECT_LT(felt_bytes(plain), plain.size());
}

TEST(FeltBytes, FinerHeightsAreMoreBytesOfHeightsAlone) {
  const auto parts = [](std::uint32_t texture, std::uint32_t triangles) {
    return felt_parts(slave_sim::bake_asset("block", slave_sim::block_mesh(),
                                            {.coarse_triangles = triangles, .texture = texture, .height_step_m = 1e-6})
                          ->asset);
  };
  const FeltParts few = parts(64, 200), finer = parts(256, 200), more = parts(64, 400);
  EXPECT_EQ(few.coarse, finer.coarse);
  EXPECT_EQ(few.pieces, finer.pieces);
  EXPECT_GT(finer.heights, 2 * few.heights);
  EXPECT_GT(2 * more.coarse, 3 * few.coarse);
  EXPECT_GT(more.pieces, few.pieces);
}

TEST(FeltBytes, NoAssetHasNone) {
  EXPECT_EQ(felt_bytes(std::span<const std::byte>()), 0U);
}

}  // namespace
}  // namespace farfeel::bench
