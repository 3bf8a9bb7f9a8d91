#include "haptic_core/contact/tracking/per_track.h"

#include <gtest/gtest.h>

namespace farfeel::contact {
namespace {

TEST(PerTrack, WhoTakesASlotFindsNothingOfWhoHadIt) {
  PerTrack<int> column;
  const std::uint32_t first = 1 * TrackNames::kSlots + 7, next = 2 * TrackNames::kSlots + 7;
  EXPECT_EQ(column.find(first), nullptr);
  column.keep(first) = 3;
  ASSERT_NE(column.find(first), nullptr);
  EXPECT_EQ(*column.find(first), 3);
  EXPECT_EQ(column.keep(first), 3) << "it goes on";
  EXPECT_EQ(column.find(next), nullptr) << "the same slot, another contact";
  EXPECT_EQ(column.keep(next), 0) << "fresh";
  EXPECT_EQ(column.find(first), nullptr);
}

TEST(PerTrack, WhatIsForgottenIsNotFound) {
  PerTrack<int> column;
  column.keep(65) = 1, column.keep(66) = 2;
  column.forget(65);
  EXPECT_EQ(column.find(65), nullptr);
  EXPECT_NE(column.find(66), nullptr);
  column.restart();
  EXPECT_EQ(column.find(66), nullptr);
}

TEST(PerTrack, WhatAnAnswerDidNotKeepIsForgottenAsTheNextBegins) {
  PerTrack<int> column;
  column.keep(65) = 1, column.keep(66) = 2;
  column.begin_answer();
  ASSERT_NE(column.find(65), nullptr) << "of the answer before";
  EXPECT_EQ(column.keep(65), 1);
  column.begin_answer();
  int sum = 0;
  column.visit([&sum](int& kept) { sum += kept; });
  EXPECT_EQ(sum, 1);
  EXPECT_EQ(column.find(66), nullptr);
}

}  // namespace
}  // namespace farfeel::contact
