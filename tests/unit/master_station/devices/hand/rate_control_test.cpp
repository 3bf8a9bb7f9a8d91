// Rate control: its curve, its ramps, its axes, and when its input is believed.
#include "master_station/devices/hand/rate_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "master_station/devices/hand/sample_source.h"

namespace farfeel::devices {
namespace {

constexpr double kDt_s = 1e-3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr RateSettings kFull{Axes::kAll, 0.2, 3};

spatial::Twist settled(RateControl& control, const Deflection& deflection) {
  spatial::Twist V;
  for (int i = 0; i < 100; ++i) V = control.advance(deflection, 1, kDt_s);
  return V;
}

TEST(RateControlTest, TheCurveIsFlatAtRestSquareAboveAndOneAtTheEnd) {
  EXPECT_EQ(shaped(0), 0);
  EXPECT_EQ(shaped(RateControl::kDeadBand), 0);
  EXPECT_EQ(shaped(1), 1);
  EXPECT_EQ(shaped(1.7), 1);
  EXPECT_EQ(shaped(kNan), 0);
  EXPECT_NEAR(shaped(RateControl::kDeadBand + 0.25 * (1 - RateControl::kDeadBand)), 1.0 / 16, 1e-12);
  double before = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double now = shaped(1e-3 * i);
    EXPECT_GE(now, before);
    EXPECT_LE(now - before, 2.2e-3) << "no step anywhere";
    before = now;
  }
}

TEST(RateControlTest, ASlantingPushStaysSlantingAndASmallOneIsNone) {
  RateControl control(kFull);
  const glm::dvec3 push{0.3, -0.5, 0.1};
  const spatial::Twist V = settled(control, {{}, push});
  const double length = glm::length(push);
  EXPECT_LT(glm::length(V.linear_m_s - 0.2 * shaped(length) / length * push), 1e-12);
  EXPECT_EQ(V.angular_rad_s, glm::dvec3(0));
  EXPECT_EQ(settled(control, {{0.03, 0.02, 0}, {0.03, 0.03, 0.02}}).linear_m_s, glm::dvec3(0));
  EXPECT_NEAR(glm::length(settled(control, {{}, {1, 1, 1}}).linear_m_s), 0.2, 1e-12) << "never faster than full";
}

TEST(RateControlTest, ItTakesTwentyMillisecondsFromRestToFullAndBack) {
  RateControl control(kFull);
  double moved_m = 0;
  for (int i = 0; i < 100; ++i) moved_m += kDt_s * control.advance({{}, {1, 0, 0}}, 1, kDt_s).linear_m_s.x;
  // The sum of 1/20 ... 20/20, and 80 times full.
  EXPECT_NEAR(moved_m, 0.2 * kDt_s * (10.5 + 80), 1e-12);
  int ticks = 0;
  while (control.advance({}, 1, kDt_s).linear_m_s.x > 1e-12) ++ticks;
  EXPECT_NEAR(ticks, 19, 1);
}

TEST(RateControlTest, NeitherRandomNorBrokenDeflectionsMakeASpeedOutOfRangeOrAStepOfIt) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.5, 1.5);
  for (const Axes axes : {Axes::kAll, Axes::kTranslation, Axes::kRotation, Axes::kDominant}) {
    RateControl control({axes, 0.2, 3});
    spatial::Twist before;
    for (int i = 0; i < 5000; ++i) {
      Deflection d{{any(random), any(random), any(random)}, {any(random), any(random), any(random)}};
      if (i % 11 == 0) d.push.y = kNan;
      if (i % 13 == 0) d.turn.z = std::numeric_limits<double>::infinity();
      const spatial::Twist V = control.advance(d, 1, kDt_s);
      ASSERT_TRUE(spatial::is_finite(V));
      ASSERT_LE(glm::length(V.linear_m_s), 0.2 + 1e-12);
      ASSERT_LE(glm::length(V.angular_rad_s), 3 + 1e-12);
      ASSERT_LE(glm::length(V.linear_m_s - before.linear_m_s), 0.2 * kDt_s / RateControl::kRise_s + 1e-12);
      ASSERT_LE(glm::length(V.angular_rad_s - before.angular_rad_s), 3 * kDt_s / RateControl::kRise_s + 1e-12);
      ASSERT_TRUE(axes != Axes::kTranslation || V.angular_rad_s == glm::dvec3(0));
      ASSERT_TRUE(axes != Axes::kRotation || V.linear_m_s == glm::dvec3(0));
      before = V;
    }
  }
}

TEST(RateControlTest, TheDominantAxisIsOneAndDoesNotTakeTurnsWithAnEqualOne) {
  RateControl control({Axes::kDominant, 0.2, 3});
  spatial::Twist V = settled(control, {{0, 0.5, 0}, {0, 0, 0.8}});
  EXPECT_GT(V.linear_m_s.z, 0.1);
  EXPECT_EQ(V.angular_rad_s, glm::dvec3(0));
  V = settled(control, {{0, 0.85, 0}, {0, 0, 0.8}});
  EXPECT_EQ(V.angular_rad_s, glm::dvec3(0)) << "a little more is not enough";
  V = settled(control, {{0, 0.85, 0}, {0, 0, 0.4}});
  EXPECT_GT(V.angular_rad_s.y, 1);
  EXPECT_LT(glm::length(V.linear_m_s), 1e-12);
}

TEST(RateControlTest, ASilentInputIsTrustedForHalfTheTimeAndNotAtAllAfterTwentyMilliseconds) {
  EXPECT_EQ(trusted_share(0), 1);
  EXPECT_EQ(trusted_share(10'000'000), 1);
  EXPECT_NEAR(trusted_share(15'000'000), 0.5, 1e-12);
  EXPECT_EQ(trusted_share(20'000'000), 0);
  EXPECT_EQ(trusted_share(std::numeric_limits<std::int64_t>::max()), 0);
  RateControl control(kFull);
  settled(control, {{}, {1, 0, 0}});
  EXPECT_EQ(control.advance({{}, {1, 0, 0}}, 0, kDt_s).linear_m_s, glm::dvec3(0));
  EXPECT_NEAR(control.advance({{}, {1, 0, 0}}, 1, kDt_s).linear_m_s.x, 0.2 / 20, 1e-12) << "and rises anew";
}

TEST(SampleSourceTest, OneThatStreamsIsAliveByItsReportsAndOneOfEventsByItsPolls) {
  Sample sample;
  sample.stage = Stage::kReady;
  sample.time_ns = 1'000'000'000;
  sample.polled_ns = 1'500'000'000;
  EXPECT_FALSE(is_heard(sample, Reports::kStream, 1'500'000'000));
  EXPECT_TRUE(is_heard(sample, Reports::kEvents, 1'500'000'000));
  EXPECT_TRUE(is_heard(sample, Reports::kStream, 1'019'999'999));
  EXPECT_FALSE(is_heard(sample, Reports::kStream, 1'020'000'000));
  EXPECT_FALSE(is_heard(sample, Reports::kEvents, 1'520'000'000));
  EXPECT_TRUE(is_heard(sample, Reports::kEvents, 1'400'000'000)) << "written after the tick took its time";
  for (std::size_t i = 0; i < kStages; ++i) {
    sample.stage = static_cast<Stage>(i);
    const bool is_set_up =
        sample.stage == Stage::kReady || sample.stage == Stage::kEnabled || sample.stage == Stage::kStopping;
    EXPECT_EQ(is_heard(sample, Reports::kEvents, 1'500'000'000), is_set_up) << name(sample.stage);
  }
  sample.stage = Stage::kReady;
  sample.polled_ns = sample.time_ns = 0;
  EXPECT_FALSE(is_heard(sample, Reports::kEvents, 1)) << "never heard";
  EXPECT_FALSE(is_heard(sample, Reports::kStream, 1));
}

}  // namespace
}  // namespace farfeel::devices
