// What a page is told of the past is half a minute, however long the session runs and however often ticks come.
#include "master_station/view/recent_bins.h"

#include <gtest/gtest.h>

namespace farfeel::master_station {
namespace {

TEST(RecentBins, KeepHalfAMinuteAndLoseNoPeak) {
  RecentBins recent;
  for (int i = 0; i < 125 * 90; ++i) {  // 90 s of ticks, 8 ms apart
    codecs::ViewTick tick;
    tick.time_ns = i * std::int64_t{8'000'000};
    for (int k = 0; k < 8; ++k) tick.bins[0].add(i == 125 * 80 && k == 3 ? 99 : 1);
    recent.add(tick);
    ASSERT_LE(recent.history().size(), RecentBins::kPieces);
  }
  const codecs::ViewHistory history = recent.history();
  EXPECT_EQ(history.back().time_ns, (125 * 90 - 1) * std::int64_t{8'000'000});
  EXPECT_GE(history.back().time_ns - history.front().time_ns, 30'000'000'000);
  float most = 0;
  std::int64_t before_ns = -1;
  for (const codecs::ViewMoment& moment : history) {
    EXPECT_GT(moment.time_ns, before_ns);
    before_ns = moment.time_ns;
    most = std::max(most, moment.bins[0].high);
  }
  EXPECT_EQ(most, 99);
}

}  // namespace
}  // namespace farfeel::master_station
