// Sequences of answers, each with the age that its pose had when it came, against a slow obvious window; and what a
// model makes of them.
#include "haptic_core/local_model/news_age.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "haptic_core/local_model/local_model.h"

namespace farfeel::local_model {
namespace {

constexpr double kTick_s = 1e-3;

/// A lane that sends a pose in every tick and has the answer back after round_trip_s(of when the pose was sent), in
/// order; what comes in one tick is the newest of it.
class Lane {
 public:
  /// Calls heard(age) or nothing in each tick, until end_s.
  void run(double end_s, const std::function<double(double)>& round_trip_s, const std::function<void(double)>& heard) {
    for (; now_s_ < end_s; now_s_ += kTick_s) {
      pass(kTick_s);
      const double round_s = round_trip_s(now_s_);
      if (std::isfinite(round_s)) {
        last_due_s_ = std::max(last_due_s_, now_s_ + round_s);
        under_way_.emplace_back(last_due_s_, now_s_);
      }
      double newest_s = -1;
      while (first_ < under_way_.size() && under_way_[first_].first <= now_s_) newest_s = under_way_[first_++].second;
      if (newest_s >= 0) heard(now_s_ - newest_s);
      if (each_tick) each_tick(now_s_);
    }
  }
  std::function<void(double)> pass;
  std::function<void(double)> each_tick;

 private:
  double now_s_ = 0, last_due_s_ = 0;
  std::vector<std::pair<double, double>> under_way_;  // due, sent
  std::size_t first_ = 0;
};

/// How long excess was beyond 50 and 250 ms, and when last.
struct Excess {
  double held_s = 0, expired_s = 0, last_held_s = 0, last_expired_s = 0;
};
Excess excess_over(double end_s, const std::function<double(double)>& round_trip_s, double from_s = 0) {
  NewsAge news;
  Lane lane;
  Excess found;
  lane.pass = [&](double dt_s) { news.pass(dt_s); };
  lane.each_tick = [&](double now_s) {
    if (!news.has_heard() || now_s < from_s) return;
    EXPECT_GE(news.excess_s(), 0);
    if (news.excess_s() > 0.05) found.held_s += kTick_s, found.last_held_s = now_s;
    if (news.excess_s() > 0.25) found.expired_s += kTick_s, found.last_expired_s = now_s;
  };
  lane.run(end_s, round_trip_s, [&](double age_s) { news.hear(age_s); });
  return found;
}

TEST(NewsAgeTest, ASteadyLaneHasNoExcessHoweverLongItIs) {
  for (const double round_s : {0.0, 0.02, 0.3, 0.6}) {
    EXPECT_EQ(excess_over(10, [=](double) { return round_s; }).held_s, 0) << round_s;
    EXPECT_EQ(excess_over(10, [=](double t) { return round_s + 0.02 * std::sin(37 * t); }).held_s, 0) << round_s;
  }
}

TEST(NewsAgeTest, ALaneThatBecomesLongerIsHeldForTheWindowAndNoLonger) {
  const Excess steps = excess_over(10, [](double t) { return t < 3 ? 0.02 : 0.2; });
  EXPECT_NEAR(steps.last_held_s, 3.02 + kAgesWindow_s, 0.11) << "after the last short one";
  EXPECT_EQ(steps.expired_s, 0) << "0.18 s are no 0.25 s";
  const Excess steps_far = excess_over(10, [](double t) { return t < 3 ? 0.02 : 0.4; });
  EXPECT_NEAR(steps_far.last_expired_s, 3.02 + kAgesWindow_s, 0.25);
}

TEST(NewsAgeTest, ALaneThatBecomesShorterIsBelievedAtOnce) {
  const Excess steps = excess_over(10, [](double t) { return t < 5 ? 0.3 : 0.02; });
  EXPECT_EQ(steps.held_s, 0);
  // And is what counts from then on.
  EXPECT_GT(excess_over(10, [](double t) { return t < 5 || t > 6 ? 0.3 : 0.02; }).held_s, 1.5);
}

TEST(NewsAgeTest, AnswersThatWaitInAQueueAreOldThoughTheyArriveAtFullRate) {
  // A queue that grows by half a second a second, up to 4 s, and stands.
  const auto queue = [](double t) { return 0.02 + std::clamp(0.5 * (t - 3), 0.0, 4.0); };
  const Excess found = excess_over(40, queue, 3);
  EXPECT_GT(found.expired_s, 40 - 3 - 1.5) << "as long as it stands";
  EXPECT_NEAR(found.last_expired_s, 40, 0.01);
}

TEST(NewsAgeTest, WhatWaitedThroughASilenceIsOldHoweverLongThatWas) {
  for (const double outage_s : {0.5, 3.0, 30.0}) {  // nothing is lost: all comes in order once the link is back
    const auto held_back = [=](double t) { return t < 3 || t > 3 + outage_s ? 0.02 : 3 + outage_s - t + 0.02; };
    NewsAge news;
    Lane lane;
    lane.pass = [&](double dt_s) { news.pass(dt_s); };
    std::vector<double> excesses_s;
    lane.run(2.99, held_back, [&](double age_s) { news.hear(age_s); });
    lane.run(3 + outage_s + 1, held_back, [&](double age_s) {
      news.hear(age_s);
      excesses_s.push_back(news.excess_s());
    });
    EXPECT_NEAR(news.least_s(), 0.02, 2e-3);
    EXPECT_LT(excesses_s.back(), 0.01) << "and what is new is good at once";
  }
  // Of a flush that takes a while, the first answer is 10 s old.
  NewsAge news;
  for (int i = 0; i < 3000; ++i) news.pass(kTick_s), news.hear(0.02);
  news.pass(10);
  for (int i = 0; i < 1000; ++i) {
    news.pass(kTick_s);
    news.hear(10 - 5e-3 * i);
    EXPECT_GT(news.excess_s(), 0.25) << i;
  }
}

TEST(NewsAgeTest, TheFirstAnswerIsTheLeastUntilAYoungerComes) {
  NewsAge news;
  news.pass(5);
  EXPECT_FALSE(news.has_heard());
  news.hear(0.3);
  EXPECT_EQ(news.excess_s(), 0);
  EXPECT_EQ(news.since_s(), 5);
  news.pass(0.1);
  EXPECT_DOUBLE_EQ(news.excess_s(), 0.1);
  EXPECT_DOUBLE_EQ(news.age_s(), 0.4);
  news.hear(0.1);
  EXPECT_EQ(news.least_s(), 0.1);
  EXPECT_DOUBLE_EQ(news.since_s(), 0.1);
}

TEST(NewsAgeTest, TheWindowIsThatOfTheSlowObviousOne) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> gap_s(0.0005, 0.01), age_s(0.01, 0.9);
  NewsAge news;
  std::vector<std::pair<double, double>> all;
  double now_s = 0;
  for (int i = 0; i < 20000; ++i) {
    const double dt_s = gap_s(random), heard_s = age_s(random);
    now_s += dt_s;
    news.pass(dt_s);
    news.hear(heard_s);
    all.emplace_back(now_s, heard_s);
    const auto least_since = [&](double since_s) {
      double least_s = 1e9;
      for (auto it = all.rbegin(); it != all.rend() && it->first >= since_s; ++it)
        least_s = std::min(least_s, it->second);
      return least_s;
    };
    EXPECT_LE(least_since(now_s - kAgesWindow_s), news.least_s() + 1e-12);
    EXPECT_GE(least_since(now_s - 0.94 * kAgesWindow_s), news.least_s() - 1e-12);
  }
}

TEST(NewsAgeTest, ContactsThatAreExpiredAreNotTakenOverAndForceComesBackSmoothly) {
  // A tool held at rest 0.5 mm deep while the lane's answers grow old in a queue, and are new again.
  LocalModel model{LocalModelSettings{}};
  const spatial::Pose X;
  contact::ContactSet set;
  set.count = 1;
  contact::Contact& contact = set.contacts[0];
  contact.nhat_ST_W = {0, 0, 1};
  contact.depth_m = 5e-4;
  contact.gradient = spatial::to_vector6(spatial::Twist{{}, {0, 0, -1}});
  contact.lateral_range_m = 1;
  contact.material = {.stiffness_N_per_m = 4000};
  const auto force_N = [&] { return model.evaluate(X, {}, kTick_s).response.F_To_W[5]; };
  Lane lane;
  double last_N = 0, faded_s = 0;
  lane.pass = [&](double dt_s) { model.advance(dt_s, X); };
  lane.each_tick = [&](double now_s) {
    EXPECT_LE(std::abs(force_N() - last_N), 0.201) << now_s;  // 0.1 N is the free step, and as much is let in a tick
    last_N = force_N();
    if (model.freshness() == Freshness::kExpired) {
      faded_s += kTick_s;
      EXPECT_TRUE(faded_s <= 0.2 || last_N == 0) << now_s;
    } else {
      faded_s = 0;
    }
  };
  const auto queue = [](double t) { return t > 2 && t < 8 ? 0.02 + 0.8 * (t - 2) : 0.02; };
  const auto heard = [&](double age_s) { model.update(set, X, age_s); };
  lane.run(1.9, queue, heard);
  EXPECT_NEAR(last_N, 2, 1e-3);
  lane.run(7.9, queue, heard);
  EXPECT_EQ(last_N, 0);
  EXPECT_EQ(model.freshness(), Freshness::kExpired);
  lane.run(16, queue, heard);
  EXPECT_NEAR(last_N, 2, 1e-3);
}

}  // namespace
}  // namespace farfeel::local_model
