#include "haptic_core/local_model/felt_once.h"

#include <gtest/gtest.h>

#include <random>

#include <vector>
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

PlacedContact at(double x_m, double depth_m, double off_m = 0) {
  return {0, {0, 0, 1}, {x_m, 0, 0}, depth_m, off_m};
}

FeltOnce of(const std::vector<PlacedContact>& found, const std::vector<PlacedContact>& told) {
  return felt_once(found, told);
}

TEST(FeltOnce, WhatNobodyHasToldOfIsFeltAsFound) {
  const FeltOnce felt = of({at(0, 1e-4, 5e-5)}, {});
  EXPECT_TRUE(felt.found[0]);
  EXPECT_EQ(felt.found_depth_m[0], 1e-4);
}

TEST(FeltOnce, WhatIsToldIsFeltWithinTheBoundAndElseTheBoundsNearerEnd) {
  for (const double told_m : {0.06e-3, 0.1e-3, 0.14e-3}) {
    const FeltOnce felt = of({at(0, 1e-4, 5e-5)}, {at(0.002, told_m)});
    EXPECT_TRUE(felt.told[0]) << told_m;
    EXPECT_FALSE(felt.found[0]);
  }
  for (const double told_m : {-3e-3, 0.02e-3, 0.18e-3, 2e-3}) {
    const FeltOnce felt = of({at(0, 1e-4, 5e-5)}, {at(0.002, told_m)});
    EXPECT_FALSE(felt.told[0]) << told_m;
    EXPECT_TRUE(felt.found[0]);
    EXPECT_NEAR(felt.found_depth_m[0], told_m < 1e-4 ? 0.5e-4 : 1.5e-4, kFoundSlack_m + 1e-9);
  }
}

/// Of what is felt the deepest, as a depth.
double deepest_m(const std::vector<PlacedContact>& found, const std::vector<PlacedContact>& told) {
  const FeltOnce felt = of(found, told);
  double most_m = -1;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (felt.found[i]) most_m = std::max(most_m, felt.found_depth_m[i]);
  for (std::size_t i = 0; i < told.size(); ++i)
    if (felt.told[i]) most_m = std::max(most_m, told[i].depth_m);
  return most_m;
}

TEST(FeltOnce, OneGoesOverIntoTheOtherWithoutAJump) {
  for (double told_m = -1e-3; told_m < 1e-3; told_m += 1e-6) {
    const std::vector<PlacedContact> found{at(0, 1e-4, 5e-5)};
    EXPECT_NEAR(deepest_m(found, {at(0, told_m)}), deepest_m(found, {at(0, told_m + 1e-6)}), 1.1e-6) << told_m;
  }
}

TEST(FeltOnce, OnePlaceNeverPushesTwiceAndNeverNotAtAll) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> way(0, 0.03), depth(-1e-3, 1e-3), off(0, 3e-4);
  for (int n = 0; n < 5000; ++n) {
    std::vector<PlacedContact> found, told;
    for (unsigned i = random() % 4; i-- > 0;) found.push_back(at(way(random), depth(random), off(random)));
    for (unsigned i = random() % 4; i-- > 0;) told.push_back(at(way(random), depth(random)));
    const FeltOnce felt = of(found, told);
    for (std::size_t f = 0; f < found.size(); ++f) {
      bool is_covered = felt.found[f];
      for (std::size_t t = 0; t < told.size(); ++t) {
        const bool is_its_own = glm::distance(found[f].p_T, told[t].p_T) < kSamePlace_m;
        bool is_nearest = is_its_own;
        for (const PlacedContact& other : found)
          is_nearest = is_nearest && glm::distance(other.p_T, told[t].p_T) >= glm::distance(found[f].p_T, told[t].p_T);
        if (is_nearest) {
          EXPECT_FALSE(felt.found[f] && felt.told[t]) << "twice";
        }
        is_covered = is_covered || told[t].depth_m >= found[f].depth_m - found[f].off_m - kFoundSlack_m;
      }
      EXPECT_TRUE(is_covered) << "a surface that nothing holds the tool off";
    }
  }
}

TEST(FeltOnce, OtherDirectionsAndObjectsHaveNothingToDoWithEachOther) {
  PlacedContact below = at(0, 2e-3), other = at(0, 2e-3);
  below.nhat_W = {0, 0, -1};
  other.object = 1;
  for (const PlacedContact& told : {below, other}) {
    const FeltOnce felt = of({at(0, 1e-4)}, {told});
    EXPECT_TRUE(felt.found[0]);
    EXPECT_TRUE(felt.told[0]);
  }
}

}  // namespace
}  // namespace farfeel::local_model
