#include "codecs/recording/outcome.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farfeel::codecs {
namespace {

const Outputs kOutputs{{"depth", {1e-3, 2e-3}}, {"force", {3, 0, -4}}, {"state", {1}}};

TEST(Outcome, TheSameIsNoDifference) {
  EXPECT_FALSE(first_difference(outcome_of(kOutputs, false), kOutputs, 0));
  EXPECT_FALSE(first_difference(outcome_of(kOutputs, true), kOutputs, 0));
}

TEST(Outcome, OneUlpIsFoundAndItsFieldNamed) {
  for (std::size_t field = 0; field < kOutputs.size(); ++field) {
    Outputs now = kOutputs;
    now[field].values.back() = std::nextafter(now[field].values.back(), 10);
    for (const bool keeps_values : {false, true}) {
      const auto difference = first_difference(outcome_of(kOutputs, keeps_values), now, 0);
      ASSERT_TRUE(difference);
      EXPECT_EQ(difference->field, kOutputs[field].name);
    }
    EXPECT_FALSE(first_difference(outcome_of(kOutputs, true), now, 1e-12));
  }
}

TEST(Outcome, AnotherZeroIsADifferenceAndAnotherNanIsNone) {
  const Outputs zero{{"force", {0.0}}}, other_zero{{"force", {-0.0}}}, nan{{"force", {std::nan("1")}}},
      other_nan{{"force", {-std::nan("2")}}};
  EXPECT_TRUE(first_difference(outcome_of(zero, false), other_zero, 0));
  EXPECT_FALSE(first_difference(outcome_of(nan, false), other_nan, 0));
  EXPECT_TRUE(first_difference(outcome_of(nan, true), zero, 1e-12));
}

TEST(Outcome, MoreThanWithinIsADifference) {
  Outputs now = kOutputs;
  now[1].values[2] = -4 - 1e-9;
  EXPECT_FALSE(first_difference(outcome_of(kOutputs, true), now, 1e-9));
  EXPECT_TRUE(first_difference(outcome_of(kOutputs, true), now, 1e-12));
  EXPECT_TRUE(first_difference(outcome_of(kOutputs, false), now, 1e-9)) << "without values nobody knows how much";
}

TEST(Outcome, AnotherNumberOfValuesOrOutputsIsADifference) {
  Outputs fewer = kOutputs, less = kOutputs;
  fewer[0].values.pop_back();
  less.pop_back();
  EXPECT_EQ(first_difference(outcome_of(kOutputs, true), fewer, 1)->field, "depth");
  EXPECT_TRUE(first_difference(outcome_of(kOutputs, true), less, 1));
}

}  // namespace
}  // namespace farfeel::codecs
