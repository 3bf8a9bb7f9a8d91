#include "haptic_core/realtime/periodic_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace farfeel::realtime {
namespace {

TEST(DeadlinesTest, FollowThePeriodWhileTicksAreShort) {
  Deadlines deadlines(1000, 100);
  for (int i = 1; i <= 10; ++i) {
    deadlines.advance(deadlines.current_ns() + 99);
    EXPECT_EQ(deadlines.current_ns(), 1000 + 100 * i);
  }
  deadlines.advance(deadlines.current_ns() + 100);  // ends exactly on the next deadline: in time
  EXPECT_EQ(deadlines.missed(), 0u);
}

TEST(DeadlinesTest, SkipAndCountWhatAnOverrunLost) {
  Deadlines deadlines(1000, 100);
  deadlines.advance(1101);
  EXPECT_EQ(deadlines.current_ns(), 1200);
  EXPECT_EQ(deadlines.missed(), 1u);
  deadlines.advance(1950);  // 1300 .. 1900 are lost
  EXPECT_EQ(deadlines.current_ns(), 2000);
  EXPECT_EQ(deadlines.missed(), 8u);
}

TEST(HistogramTest, MatchesSortedDurations) {
  std::mt19937 random(3);
  std::lognormal_distribution<double> duration(10, 3);
  Histogram histogram;
  std::vector<std::int64_t> sorted;
  for (int i = 0; i < 10'000; ++i) {
    sorted.push_back(static_cast<std::int64_t>(duration(random)));
    histogram.add(sorted.back());
  }
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(histogram.count(), sorted.size());
  EXPECT_EQ(histogram.max_ns(), sorted.back());
  for (double q : {0.0, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(q * 10'000)));
    const auto exact = static_cast<double>(sorted[rank - 1]);
    EXPECT_NEAR(static_cast<double>(histogram.quantile_ns(q)), exact, exact / 32 + 1e-9) << q;
  }
  EXPECT_EQ(histogram.quantile_ns(1), sorted.back());
}

TEST(HistogramTest, TakesEveryDurationThereIs) {
  Histogram histogram;
  EXPECT_EQ(histogram.quantile_ns(0.5), 0);
  for (std::int64_t duration : {std::int64_t{-5}, std::int64_t{0}, std::int64_t{15}, std::int64_t{16}, std::int64_t{17},
                                std::int64_t{1} << 62, std::numeric_limits<std::int64_t>::max()})
    histogram.add(duration);
  EXPECT_EQ(histogram.count(), 7u);
  EXPECT_EQ(histogram.quantile_ns(0.1), 0);
  EXPECT_EQ(histogram.max_ns(), std::numeric_limits<std::int64_t>::max());
}

TEST(PeriodicLoopTest, TicksNeverEarlyAndStopsWhenTold) {
  std::atomic<bool> stop = false;
  PeriodicStatistics statistics;
  int ticks = 0;
  std::int64_t last_deadline_ns = 0;
  run_periodically({.period_ns = 200'000, .fifo_priority = 0}, stop, statistics, [&](const TickTiming& timing) {
    EXPECT_GE(monotonic_now_ns(), timing.deadline_ns);
    EXPECT_GE(timing.wake_ns, 0);
    if (ticks > 0) {
      EXPECT_EQ((timing.deadline_ns - last_deadline_ns) % 200'000, 0);
    }
    last_deadline_ns = timing.deadline_ns;
    if (++ticks == 150) stop = true;
  });
  EXPECT_EQ(ticks, 150);
  EXPECT_EQ(statistics.work_ns.count(), 150u);
  EXPECT_EQ(statistics.wake_ns.count(), 150u);
}

}  // namespace
}  // namespace farfeel::realtime
