#include "tests/bench/link_statistics.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::bench {
namespace {

/// By the definition: the least sample such that as many samples as asked are no greater.
double slow_quantile(const std::vector<double>& samples, double q) {
  double least = std::numeric_limits<double>::infinity();
  for (const double candidate : samples) {
    const auto count = std::count_if(samples.begin(), samples.end(), [&](double s) { return s <= candidate; });
    if (static_cast<double>(count) >= q * static_cast<double>(samples.size()) - 1e-9)
      least = std::min(least, candidate);
  }
  return least;
}

TEST(LinkStatistics, QuantilesAreTheNearestRanks) {
  std::mt19937 random(7);
  for (const std::size_t size : {1u, 2u, 3u, 7u, 100u, 999u, 1000u, 1001u}) {
    std::vector<double> samples(size);
    for (double& s : samples) s = static_cast<double>(random() % 50);
    for (const double q : {0.001, 0.5, 0.9, 0.99, 0.999, 1.0})
      EXPECT_EQ(quantile(samples, q), slow_quantile(samples, q)) << size << " samples, " << q;
  }
  EXPECT_EQ(quantile(std::vector<float>{}, 0.5, 7), 7);
}

TEST(LinkStatistics, MediansAreOfEachQuantileAndPassOverRoundsWithoutSamples) {
  const std::vector<Quantiles> rounds{{5, 10, 11}, {1, 30, 31}, {3, 20, 99}, {2, 50, 51}, {4, 40, 41}};
  const Quantiles median = medians(rounds);
  EXPECT_EQ(median.p50, 3);
  EXPECT_EQ(median.p99, 30);
  EXPECT_EQ(median.p99_9, 41);
  EXPECT_EQ(medians({{5, 6, 7}, quantiles({}), {1, 2, 3}, {3, 4, 5}}).p50, 3);
  EXPECT_TRUE(std::isnan(medians({}).p99));
}

}  // namespace
}  // namespace farfeel::bench
