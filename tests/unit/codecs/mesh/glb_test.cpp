#include "codecs/mesh/glb.h"

#include <gtest/gtest.h>

#include <array>

namespace farfeel::codecs {
namespace {

TEST(GlbTest, JoinsAndSplits) {
  const std::array<std::byte, 5> binary{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}};
  const auto bytes = joined_glb({{"a", 1}}, binary);
  EXPECT_EQ(bytes.size() % 4, 0U);
  const auto glb = split_glb(bytes);
  ASSERT_TRUE(glb) << glb.error();
  EXPECT_EQ(glb->json["a"], 1);
  ASSERT_EQ(glb->binary.size(), 8U);  // padded
  EXPECT_TRUE(std::equal(binary.begin(), binary.end(), glb->binary.begin()));
}

TEST(GlbTest, DeepNestingIsRefusedBeforeItIsParsed) {
  EXPECT_FALSE(bounded_json(std::string(20, '[') + std::string(20, ']')).is_discarded());
  EXPECT_TRUE(bounded_json(std::string(1'000'000, '[')).is_discarded());
  EXPECT_FALSE(bounded_json("{\"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\\\"[[\": 1}").is_discarded());
}

TEST(GlbTest, BufferViewsLieWithin) {
  const std::array<std::byte, 8> binary{};
  const auto ok = [&](nlohmann::json view) {
    return buffer_view({{"bufferViews", nlohmann::json::array({view})}}, binary, 0).has_value();
  };
  EXPECT_TRUE(ok({{"buffer", 0U}, {"byteLength", 8U}}));
  EXPECT_TRUE(ok({{"buffer", 0U}, {"byteOffset", 8U}, {"byteLength", 0U}}));
  EXPECT_FALSE(ok({{"buffer", 0U}, {"byteOffset", 4U}, {"byteLength", 5U}}));
  EXPECT_FALSE(ok({{"buffer", 0U}, {"byteLength", 0xFFFF'FFFF'FFFF'FFFFU}}));
  EXPECT_FALSE(ok({{"buffer", 0U}, {"byteOffset", -4}, {"byteLength", 4U}}));
  EXPECT_FALSE(ok({{"buffer", 0U}, {"byteLength", 1.5}}));
  EXPECT_FALSE(ok({{"byteLength", 8U}}));
  EXPECT_FALSE(buffer_view({{"bufferViews", nlohmann::json::array()}}, binary, 0).has_value());
  EXPECT_FALSE(buffer_view(nlohmann::json::object(), binary, 0).has_value());
}

}  // namespace
}  // namespace farfeel::codecs
