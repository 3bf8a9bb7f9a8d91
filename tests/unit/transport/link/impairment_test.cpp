#include "transport/link/impairment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;

LinkSpec spec(const std::string& text) {
  return parse_link_spec(text).value();
}

TEST(Impairment, OfNothingReleasesAtOnce) {
  Impairment link({}, 1);
  for (std::int64_t t = 0; t < 100; ++t) {
    const auto releases = link.releases(t, 100);
    ASSERT_EQ(releases.size(), 1u);
    EXPECT_EQ(releases[0], t);
  }
}

TEST(Impairment, DelaysByHalfTheRoundTripAndSpreadsByTheJitterInOrder) {
  Impairment link(spec("rtt=100ms jitter=10ms"), 7);
  std::int64_t before = 0, least = kTick_ns * 1000, most = 0;
  for (std::int64_t i = 0; i < 20'000; ++i) {
    // Far apart, so that keeping the order hides nothing of the spread.
    const std::int64_t now = i * 20 * kTick_ns;
    const std::int64_t release = link.releases(now, 100).front();
    EXPECT_GE(release, before);
    before = release;
    least = std::min(least, release - now);
    most = std::max(most, release - now);
  }
  EXPECT_NEAR(static_cast<double>(least), 45e6, 0.1e6);
  EXPECT_NEAR(static_cast<double>(most), 55e6, 0.1e6);
}

TEST(Impairment, KeepsTheOrderOfDenseTraffic) {
  Impairment link(spec("rtt=20ms jitter=10ms"), 3);
  std::int64_t before = 0;
  for (std::int64_t i = 0; i < 10'000; ++i) {
    const std::int64_t release = link.releases(i * kTick_ns, 100).front();
    EXPECT_GE(release, before);
    EXPECT_LE(release - i * kTick_ns, 15'000'000);
    before = release;
  }
}

TEST(Impairment, LosesTheAskedShareInBurstsOfTheAskedLength) {
  for (const double burst : {1.0, 4.0, 16.0}) {
    LinkSpec wanted;
    wanted.loss = 0.05;
    wanted.burst = burst;
    Impairment link(wanted, 11);
    constexpr int kCount = 400'000;
    int lost = 0, bursts = 0;
    bool was_lost = false;
    for (int i = 0; i < kCount; ++i) {
      const bool is_lost = link.releases(i * kTick_ns, 100).empty();
      lost += is_lost;
      bursts += is_lost && !was_lost;
      was_lost = is_lost;
    }
    EXPECT_NEAR(static_cast<double>(lost) / kCount, 0.05, 0.005) << burst;
    const double expected = burst > 1 ? burst : 1 / 0.95;  // independent losses are sometimes neighbours
    EXPECT_NEAR(static_cast<double>(lost) / bursts, expected, 0.06 * expected) << burst;
    EXPECT_EQ(link.counters().lost, static_cast<std::uint64_t>(lost));
  }
}

TEST(Impairment, HoldsBackAndDuplicatesTheAskedShares) {
  Impairment link(spec("rtt=10ms reorder=2% duplicate=3%"), 5);
  int overtaken = 0, duplicated = 0;
  std::int64_t newest = 0;
  for (std::int64_t i = 0; i < 100'000; ++i) {
    const auto releases = link.releases(i * kTick_ns, 100);
    overtaken += releases[0] > i * kTick_ns + 5'000'000;
    duplicated += releases.size() == 2;
    newest = std::max(newest, releases[0]);
  }
  EXPECT_NEAR(overtaken, 2000, 200);
  EXPECT_NEAR(duplicated, 3000, 250);
}

TEST(Impairment, DropsPacketsThatAreTooLong) {
  LinkSpec spec;
  spec.mtu_bytes = 576;
  Impairment link(spec, 1);
  EXPECT_EQ(link.releases(0, 548).size(), 1u);  // with 28 bytes of headers just as long as that
  EXPECT_TRUE(link.releases(1, 549).empty());
  EXPECT_EQ(link.counters().too_long, 1u);
}

TEST(Impairment, LimitsTheRateAndDropsWhatWouldWaitTooLong) {
  // 1000 datagrams of 1250 B a second are 10 Mbit/s into 1 Mbit/s: one in ten gets through, after the full queue.
  Impairment link(spec("rate=1Mbit queue=50ms"), 1);
  int passed = 0;
  std::int64_t last = 0;
  for (std::int64_t i = 0; i < 10'000; ++i) {
    const auto releases = link.releases(i * kTick_ns, 1250);
    if (releases.empty()) continue;
    ++passed;
    EXPECT_LE(releases[0] - i * kTick_ns, 60'000'000 + kTick_ns);
    last = releases[0];
  }
  EXPECT_NEAR(passed, 1000, 10);
  EXPECT_NEAR(static_cast<double>(last), 1e10, 1e8);
}

TEST(Impairment, RepeatsItselfForEqualSeeds) {
  const LinkSpec wanted = spec("rtt=10ms jitter=5ms loss=3%,burst=2 reorder=1% duplicate=1%");
  const auto history = [&](std::uint64_t seed) {
    Impairment link(wanted, seed);
    std::vector<std::int64_t> all;
    for (std::int64_t i = 0; i < 2000; ++i) {
      const auto releases = link.releases(i * kTick_ns, 100);
      all.insert(all.end(), releases.begin(), releases.end());
    }
    return all;
  };
  EXPECT_EQ(history(1), history(1));
  EXPECT_NE(history(1), history(2));
}

}  // namespace
}  // namespace farfeel::transport
