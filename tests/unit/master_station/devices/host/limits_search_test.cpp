// The search against simulated devices whose stiffest calm spring is known by trying them without friction and encoder.
#include "master_station/devices/host/limits_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/devices/simulated_axis.h"

namespace farfeel::devices {
namespace {

using test_support::SimulatedAxis;
using test_support::stiffest_calm_N_per_m;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr int kTicksMax = 3'600'000;

struct Searched {
  LimitsSearch::Outcome outcome = LimitsSearch::Outcome::kNone;
  double taken_N_per_m = 0, held_N_per_m = 0;
  double most_over_J = -1;  ///< of all trials: truly given, less kMostGiven_J and one tick's work
  double most_given_J = 0;
  double most_N = 0;
  int trials = 0;
  double seconds = 0;
};

LimitsSearch::Settings settings_for(const SimulatedAxis::Figures& figures, double damping_Ns_per_m) {
  LimitsSearch::Settings settings;
  settings.damping_Ns_per_m = damping_Ns_per_m;
  settings.position_step_m = figures.step_m;
  settings.delay_s = 1e-3 * (figures.sensor_ticks + figures.actuator_ticks);
  return settings;
}

Searched searched(const SimulatedAxis::Figures& figures, LimitsSearch::Settings settings) {
  SimulatedAxis axis(figures, 0.0123456);
  LimitsSearch search(settings);
  Searched result;
  int i = 0, trial = 0;
  for (; i < kTicksMax && !search.outcome(); ++i) {
    const double force_N = search.step(i * kTick_ns, {axis.told_m(), axis.told_m_s(), true});
    if (search.trials() != trial) {
      trial = search.trials();
      axis.forget_given();
    }
    axis.push(force_N);
    result.most_N = std::max(result.most_N, std::abs(force_N));
    result.most_given_J = std::max(result.most_given_J, axis.most_given_J());
    result.most_over_J =
        std::max(result.most_over_J, axis.most_given_J() - LimitsSearch::kMostGiven_J - axis.most_in_a_tick_J());
  }
  EXPECT_TRUE(search.outcome()) << "it does not end";
  result.outcome = search.outcome().value_or(LimitsSearch::Outcome::kNone);
  result.taken_N_per_m = search.taken_N_per_m();
  result.held_N_per_m = search.held_N_per_m();
  result.trials = search.trials();
  result.seconds = 1e-3 * i;
  return result;
}

struct Case {
  const char* name;
  SimulatedAxis::Figures figures;
  double damping_Ns_per_m;
};

SimulatedAxis::Figures figures(double mass_kg, double viscous, double coulomb_N, double step_m, int sensor_ticks,
                               int actuator_ticks) {
  SimulatedAxis::Figures f;
  f.mass_kg = mass_kg;
  f.viscous_Ns_per_m = viscous;
  f.coulomb_N = coulomb_N;
  f.step_m = step_m;
  f.sensor_ticks = sensor_ticks;
  f.actuator_ticks = actuator_ticks;
  return f;
}

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"smooth", figures(0.1, 2, 0, 1e-6, 0, 0), 0},
      {"smooth, late", figures(0.1, 2, 0, 1e-6, 1, 1), 0.5},
      {"of a desktop device", figures(0.1, 2, 0.1, 20e-6, 0, 1), 0.5},
      {"later", figures(0.1, 2, 0.1, 20e-6, 1, 1), 0.5},
      {"latest", figures(0.1, 2, 0.1, 20e-6, 2, 3), 0.5},
      {"light", figures(0.045, 1, 0.04, 30e-6, 0, 1), 0.25},
      {"heavy", figures(0.4, 2, 0.2, 20e-6, 1, 1), 0.5},
      {"rubbed", figures(0.15, 3, 0.4, 20e-6, 1, 1), 0.75},
      {"coarse", figures(0.12, 3, 0.2, 40e-6, 1, 1), 0.75},
      {"damped", figures(0.2, 8, 0.2, 10e-6, 1, 1), 2},
      {"in time, rubbed", figures(0.15, 2, 0.1, 20e-6, 0, 0), 0},
  };
  return all;
}

class LimitsSearchTest : public testing::TestWithParam<int> {};

TEST_P(LimitsSearchTest, TakesTwoThirdsOfTheStiffestCalmSpringAndNeverGivesMoreThanItMay) {
  const Case& one = cases()[static_cast<std::size_t>(GetParam())];
  const double truth = stiffest_calm_N_per_m(one.figures, one.damping_Ns_per_m);
  const Searched found = searched(one.figures, settings_for(one.figures, one.damping_Ns_per_m));
  EXPECT_GE(found.taken_N_per_m, 0.55 * truth) << one.name;
  EXPECT_LE(found.taken_N_per_m, 0.75 * truth) << one.name;
  EXPECT_LE(found.most_over_J, 0) << one.name;
  EXPECT_LE(found.most_N, LimitsSearch::kMostForce_N) << one.name;
}

TEST(LimitsSearch, TheStiffestCalmSpringOfTheSimulatedDevicesIsTheOneThatTheoryTells) {
  // (b + B + hand) / (T/2 + delay), which is exact for a heavy handle and early enough.
  for (const Case& one : cases()) {
    const SimulatedAxis::Figures& f = one.figures;
    const double told = (f.viscous_Ns_per_m + f.hand_Ns_per_m + one.damping_Ns_per_m) /
                        (1e-3 * (0.5 + f.sensor_ticks + f.actuator_ticks));
    EXPECT_NEAR(stiffest_calm_N_per_m(f, one.damping_Ns_per_m), told, 0.2 * told) << one.name;
  }
}

TEST(LimitsSearch, OnAnyDeviceNeverTakesTooStiffAOneNorGivesTooMuch) {
  std::mt19937 random(7);
  const auto between = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<>(0, 1)(random));
  };
  constexpr int kDevices = 60;
  int found_well = 0;
  for (int i = 0; i < kDevices; ++i) {
    SimulatedAxis::Figures f = figures(between(0.04, 0.5), between(0.7, 8), between(0.01, 0.4), between(1e-6, 40e-6),
                                       static_cast<int>(random() % 3), static_cast<int>(random() % 4));
    f.hand_N = std::uniform_real_distribution<>(-0.7, 0.7)(random) * f.coulomb_N;  // it leans, and friction holds it
    const double damping = f.sensor_ticks + f.actuator_ticks == 0 ? 0 : f.viscous_Ns_per_m / 4;
    const double truth = stiffest_calm_N_per_m(f, damping);
    const Searched found = searched(f, settings_for(f, damping));
    SCOPED_TRACE(testing::Message() << "device " << i << ": " << f.mass_kg << " kg, " << f.viscous_Ns_per_m << " Ns/m, "
                                    << f.coulomb_N << " N, step " << f.step_m << " m, delay "
                                    << f.sensor_ticks + f.actuator_ticks << " ticks, true " << truth << ", taken "
                                    << found.taken_N_per_m / truth << " of it");
    EXPECT_LE(found.taken_N_per_m, 0.75 * truth);
    EXPECT_LE(found.most_over_J, 0);
    EXPECT_LE(found.most_N, LimitsSearch::kMostForce_N);
    if (found.taken_N_per_m >= 0.55 * truth) ++found_well;
    if (found.taken_N_per_m == 0) {
      EXPECT_EQ(found.outcome, LimitsSearch::Outcome::kNone) << "it has to say so";
    }
  }
  EXPECT_GE(found_well, kDevices * 9 / 10) << "the others are found softer, or not at all";
}

TEST(LimitsSearch, ADelayThatIsUnderstatedCostsNobodyMore) {
  for (const Case& one : cases()) {
    LimitsSearch::Settings settings = settings_for(one.figures, one.damping_Ns_per_m);
    settings.delay_s = std::max(settings.delay_s - LimitsSearch::kDelayDoubt_s, 0.0);
    EXPECT_LE(searched(one.figures, settings).most_over_J, 0) << one.name;
  }
}

TEST(LimitsSearch, SaysSoWhereFrictionIsStrongerThanItsKicks) {
  const Searched found = searched(figures(0.1, 2, 2.2, 20e-6, 1, 1), {0.5, 20e-6, 2e-3});
  EXPECT_EQ(found.outcome, LimitsSearch::Outcome::kNone);
  EXPECT_EQ(found.taken_N_per_m, 0);
}

TEST(LimitsSearch, SaysSoWhereNothingStifferIsTried) {
  LimitsSearch::Settings settings = settings_for(cases()[0].figures, 0);
  settings.most_N_per_m = 1000;
  const Searched found = searched(cases()[0].figures, settings);
  EXPECT_EQ(found.outcome, LimitsSearch::Outcome::kAllHeld);
  EXPECT_EQ(found.held_N_per_m, 1000);
}

TEST(LimitsSearch, PushesOnlyWhileItMayAndNeverOnBadReadings) {
  const SimulatedAxis::Figures& f = cases()[2].figures;
  SimulatedAxis axis(f);
  LimitsSearch search(settings_for(f, 0.5));
  std::mt19937 random(3);
  int pushed = 0;
  for (int i = 0; i < 60'000; ++i) {
    LimitsSearch::Input input{axis.told_m(), axis.told_m_s(), true};
    const auto what = static_cast<unsigned>(random() % 1000);
    if (what == 0) input.may_push = false;
    if (what == 1) input.position_m = std::nan("");
    if (what == 2) input.velocity_m_s = std::numeric_limits<double>::infinity();
    const double force_N = search.step(i * kTick_ns, input);
    ASSERT_TRUE(std::isfinite(force_N));
    if (what <= 2) {
      ASSERT_EQ(force_N, 0);
    }
    if (force_N != 0) ++pushed;
    axis.push(force_N);
  }
  EXPECT_GT(pushed, 100) << "it does try between";
}

INSTANTIATE_TEST_SUITE_P(Devices, LimitsSearchTest, testing::Range(0, 11));

}  // namespace
}  // namespace farfeel::devices
