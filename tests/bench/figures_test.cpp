// What the source says of its curves, on small plates: force across ridges follows them and is nearly none along them;
// interlocked ridges rise with every twist and resist it.
#include <gtest/gtest.h>

#include "slave_sim/models/height_plate.h"
#include "tests/bench/figure_runs.h"

namespace farfeel::bench {
namespace {

constexpr double kPeriod_m = 3e-3;
const glm::dquat kTurnedOver{0, 1, 0, 0};

struct Ridged {
  geometry::HapticSurface s = slave_sim::ridged_plate(kPeriod_m, 0.8e-3, {.size_m = {0.036, 0.024, 0.004}}),
                          t = slave_sim::ridged_plate(kPeriod_m, 0.8e-3, {.size_m = {0.012, 0.010, 0.004}});
};

TEST(Figures, AToolPulledOverRidgesCatchesAndSlipsAndFeelsNothingAlongThem) {
  const Ridged ridged;
  const Laid laid{.s = &ridged.s, .t = &ridged.t, .R_WT = kTurnedOver, .above_W = {-0.5 * kPeriod_m, 0, 0}};
  const StrokeFacts facts = facts_of(stroke_over_ridges(laid, 2.6 * kPeriod_m, 1.5, 1500));
  EXPECT_LT(facts.along_share, 0.02);
  EXPECT_GE(facts.stairs, 2);
  EXPECT_GT(facts.correlation, 0.9);
}

TEST(Figures, ATwistLiftsWhatInterlocksAndIsOpposed) {
  const Ridged ridged;
  const Laid laid{.s = &ridged.s, .t = &ridged.t, .R_WT = kTurnedOver, .above_W = {-0.5 * kPeriod_m, 0, 0}};
  const TwistFacts facts = facts_of(twist_interlocked(laid, 0.1, 2, 1.5, 300), 2);
  EXPECT_EQ(facts.rises, 1);
  EXPECT_GT(facts.opposes, 0.95);
  EXPECT_GT(facts.rise_m, 0.02e-3);
}

}  // namespace
}  // namespace farfeel::bench
