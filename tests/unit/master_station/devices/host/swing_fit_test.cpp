#include "master_station/devices/host/swing_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace farfeel::devices {
namespace {

TEST(TurningPoints, AreWhereASineTurnsToFractionsOfItsSamples) {
  constexpr double kAmplitude_m = 1e-3, kSamplesAPeriod = 14.3, kDecay = 0.97;  // the last: each half period
  TurningPoints turns(1e-7);
  for (int i = 0; i < 100; ++i) {
    const double turn = 2 * M_PI * i / kSamplesAPeriod;
    turns.add(kAmplitude_m * std::pow(kDecay, 2 * i / kSamplesAPeriod) * std::sin(turn));
  }
  const std::vector<double> stops = turns.stops_m(0, false);
  ASSERT_GE(stops.size(), 12U);
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const double expected = kAmplitude_m * std::pow(kDecay, static_cast<double>(i) + 0.5) * (i % 2 == 0 ? 1 : -1);
    EXPECT_NEAR(stops[i], expected, 0.01 * kAmplitude_m) << i;
  }
  EXPECT_FALSE(turns.rests(20));
}

TEST(TurningPoints, IgnoreTheEncodersOwnStepsAndEndWhereTheHandleStays) {
  TurningPoints turns(20e-6);
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) turns.add(1e-3 + 20e-6 * static_cast<double>(random() % 2));
  EXPECT_TRUE(turns.at().empty());
  EXPECT_TRUE(turns.rests(40));
  EXPECT_EQ(turns.stops_m(0, true).size(), 1U);
}

/// Stops of a swing with ratio r, friction c/K and a lean g, until it sticks.
std::vector<double> swing(double first_m, double ratio, double friction_m, double lean_m) {
  std::vector<double> stops{first_m};
  for (int i = 0; i < 30; ++i) {
    const double side = stops.back() > lean_m ? 1 : -1, from_middle_m = std::abs(stops.back() - lean_m);
    if (from_middle_m <= friction_m) break;
    stops.push_back(lean_m - side * (ratio * (from_middle_m - friction_m) - friction_m));
  }
  return stops;
}

TEST(SwingFit, TellsDryFrictionAndALeaningHandFromWhatCalms) {
  for (const double ratio : {0.6, 0.95, 1.0, 1.1}) {
    for (const double friction_m : {0.0, 0.1e-3}) {
      for (const double lean_m : {0.0, 0.05e-3}) {
        SwingFit fit(0);
        for (const double first_m : {0.5e-3, -0.6e-3, 0.8e-3, -1e-3, 0.7e-3}) {
          const std::vector<double> stops = swing(first_m, ratio, friction_m, lean_m);
          fit.add(std::span(stops).first(std::min<std::size_t>(stops.size(), 4)), 20e-6);
        }
        ASSERT_GE(fit.swings(), SwingFit::kSwingsMin);
        const SwingFit::Result result = fit.result();
        EXPECT_NEAR(result.ratio, ratio, 1e-3) << friction_m << " " << lean_m;
        EXPECT_NEAR(result.lost_m, (1 + ratio) * friction_m, 1e-6) << ratio << " " << lean_m;
        EXPECT_LT(result.ratio_error, 1e-2);
      }
    }
  }
}

TEST(SwingFit, IsNotSureOfSwingsThatAreAlike) {
  SwingFit fit(0);
  std::mt19937 random(1);
  std::normal_distribution<> noise_m(0, 1e-6);
  for (int i = 0; i < 20; ++i) fit.add(std::array{0.5e-3 + noise_m(random), -0.3e-3 + noise_m(random)}, 20e-6);
  const SwingFit::Result result = fit.result();
  EXPECT_FALSE(std::abs(1 - result.ratio) > 2 * result.ratio_error && result.ratio > 1);
}

}  // namespace
}  // namespace farfeel::devices
