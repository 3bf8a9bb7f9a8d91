#include "codecs/text/nearest_word.h"

#include <gtest/gtest.h>

#include <array>

namespace farfeel::codecs {
namespace {

TEST(NearestWord, ForgivesTypingMistakesOnly) {
  constexpr std::array<std::string_view, 4> kWords = {"loopback", "report", "doctor", "link"};
  EXPECT_EQ(nearest_word("loopbak", kWords), "loopback");
  EXPECT_EQ(nearest_word("raport", kWords), "report");
  EXPECT_EQ(nearest_word("dcotor", kWords), "doctor");
  EXPECT_EQ(nearest_word("lnik", kWords), "link");
  EXPECT_EQ(nearest_word("dance", kWords), "");
  EXPECT_EQ(nearest_word("", kWords), "");
}

}  // namespace
}  // namespace farfeel::codecs
