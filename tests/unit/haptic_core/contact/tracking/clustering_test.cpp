#include "haptic_core/contact/tracking/clustering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace farfeel::contact {
namespace {

using collision::ProximityPair;
using glm::dvec3;

constexpr double kTolerance = 0.005, kTick = 0.001;

ProximityPair pair_at(std::uint32_t s, std::uint32_t t, const dvec3& p, const dvec3& n, double distance) {
  return {s, t, distance, p - 0.5 * distance * n, p + 0.5 * distance * n, n, {}, {}, 1, true};
}

TEST(Clustering, NothingNearIsNoCluster) {
  Clustering clustering;
  EXPECT_TRUE(clustering.update({}, kTolerance, kTick).empty());
}

TEST(Clustering, OnePlaceIsOneCluster) {
  Clustering clustering;
  const std::vector<ProximityPair> pairs = {pair_at(0, 0, {0, 0, 0}, {0, 0, 1}, -0.001),
                                            pair_at(0, 1, {0.004, 0, 0}, {0, 0, 1}, 0.001),
                                            pair_at(2, 1, {0.002, 0.002, 0}, {0, 0.1, 0.99498743710662}, 0.002)};
  const auto clusters = clustering.update(pairs, kTolerance, kTick);
  ASSERT_EQ(clusters.size(), 1U);
  EXPECT_EQ(clusters[0].depth_m, 0.001);
  EXPECT_EQ(clusters[0].pairs, 3U);
  EXPECT_EQ(clusters[0].pieces_s.count, 2U);
  EXPECT_EQ(clusters[0].pieces_t.count, 2U);
  EXPECT_NEAR(glm::length(clusters[0].nhat_ST_S), 1, 1e-12);
  EXPECT_NEAR(clusters[0].p_S.x, (0.006 * 0 + 0.004 * 0.004 + 0.003 * 0.002) / 0.013, 1e-12);
}

TEST(Clustering, OpposedWallsStayApart) {
  Clustering clustering;
  std::vector<ProximityPair> pairs;
  for (std::uint32_t i = 0; i < 6; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    pairs.push_back(pair_at(i, 0, {-0.001 * side, 0.001 * i, 0}, {side, 0, 0}, 0.001));
  }
  const auto clusters = clustering.update(pairs, kTolerance, kTick);
  ASSERT_EQ(clusters.size(), 2U);
  EXPECT_LT(glm::dot(clusters[0].nhat_ST_S, clusters[1].nhat_ST_S), -0.999);
}

TEST(Clustering, ManyPlacesAreMergedIntoAHandful) {
  ClusteringOptions options;
  options.max_clusters = 7;
  Clustering clustering(options);
  std::vector<ProximityPair> pairs;
  for (std::uint32_t i = 0; i < 40; ++i) pairs.push_back(pair_at(i, 0, {0.05 * i, 0, 0}, {0, 0, 1}, 0.001));
  const auto clusters = clustering.update(pairs, kTolerance, kTick);
  EXPECT_EQ(clusters.size(), 7U);
  std::uint32_t all = 0;
  for (const Cluster& c : clusters) all += c.pairs;
  EXPECT_EQ(all, 40U);
}

// Among too many places one lies between two clusters, far from both, and trembles.
TEST(Clustering, WhatIsFarFromAllClustersStaysWithItsOwn) {
  ClusteringOptions options;
  options.max_clusters = 2;
  Clustering clustering(options);
  std::mt19937 random(7);
  std::normal_distribution<double> tremor(0, 20e-6);
  std::vector<ProximityPair> pairs;
  for (std::uint32_t i = 0; i < 200; ++i)
    pairs.push_back(pair_at(i, 0, {i % 2 == 0 ? -0.05 : 0.05, 1e-5 * i, 0}, {0, 0, 1}, 0.001));
  pairs.push_back({});
  std::vector<std::uint32_t> sizes;  // of the first, tick by tick
  for (int tick = 0; tick < 200; ++tick) {
    pairs.back() = pair_at(200, 0, {tremor(random), 0, 0}, {0, 0, 1}, 0.0049);
    const auto clusters = clustering.update(pairs, kTolerance, kTick);
    ASSERT_EQ(clusters.size(), 2U);
    if (tick >= 100) sizes.push_back(clusters[0].id < clusters[1].id ? clusters[0].pairs : clusters[1].pairs);
  }
  EXPECT_EQ(*std::min_element(sizes.begin(), sizes.end()), *std::max_element(sizes.begin(), sizes.end()));
}

TEST(Clustering, BackFacesAreNoContact) {
  Clustering clustering;
  ProximityPair pair = pair_at(0, 0, {0, 0, 0}, {0, 0, 1}, 0.001);
  pair.facing = 0;
  EXPECT_TRUE(clustering.update({&pair, 1}, kTolerance, kTick).empty());
}

// A peg in a hole touches along lines, and which of their ends is the witness is a matter of rounding.
TEST(Clustering, LinesWhoseWitnessesHopFromEndToEndKeepTheirClusters) {
  Clustering clustering;
  const auto wall_at = [](std::uint32_t i, double z) {
    const double angle = 0.1 * i;
    const dvec3 out(std::cos(angle), std::sin(angle), 0);
    return pair_at(i, 0, 0.01 * out + dvec3(0, 0, z), -out, -0.001);
  };
  std::mt19937 random(4);
  std::bernoulli_distribution is_up;
  std::vector<double> z(20, 0.01);
  std::map<std::uint32_t, int> names;  // of clusters, and how often seen
  constexpr int kSettled = 100, kTicks = 400;
  for (int tick = -kSettled; tick < kTicks; ++tick) {
    std::vector<ProximityPair> pairs;
    for (std::uint32_t i = 0; i < z.size(); ++i) {
      if (tick >= 0 && (tick + static_cast<int>(i)) % 5 == 0) z[i] = is_up(random) ? 0.01 : -0.01;
      pairs.push_back(wall_at(i, z[i]));
    }
    for (const Cluster& c : clustering.update(pairs, kTolerance, kTick)) names[c.id] += tick >= 0 ? 1 : 0;
  }
  for (const auto& [id, ticks] : names) EXPECT_EQ(ticks, kTicks) << id;

  // One that stays where it hopped to is there after a while, and nowhere else: it is a place of its own.
  std::size_t clusters = 0;
  for (std::uint32_t tick = 0; tick < 2000; ++tick) {
    const std::vector<ProximityPair> pairs = {wall_at(0, -0.01), wall_at(1, -0.01), wall_at(2, 0.01)};
    clusters = clustering.update(pairs, kTolerance, kTick).size();
  }
  EXPECT_EQ(clusters, 2U);
}

// Contacts that wander, appear and vanish: what a living id reports moves no faster than promised.
TEST(Clustering, MovesAtBoundedSpeed) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const ClusteringOptions options;
  Clustering clustering(options);
  std::vector<ProximityPair> pairs;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const dvec3 n = glm::normalize(dvec3(normal(random), normal(random), 2));
    pairs.push_back(pair_at(i, 0, 0.03 * dvec3(normal(random), normal(random), 0), n, 0.002 * normal(random) + 0.002));
  }
  std::map<std::uint32_t, Cluster> last;
  std::uint32_t lived = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    double fastest = 0;
    std::vector<ProximityPair> near;
    for (ProximityPair& p : pairs) {
      const double change = 2e-4 * normal(random);
      p.distance_m += change;
      p.p_Ss_S += 3e-4 * dvec3(normal(random), normal(random), 0);
      p.p_St_S = p.p_Ss_S + p.distance_m * p.nhat_ST_S;
      if (p.distance_m < kTolerance) near.push_back(p), fastest = std::max(fastest, std::abs(change));
    }
    std::map<std::uint32_t, Cluster> now;
    for (const Cluster& c : clustering.update(near, kTolerance, kTick)) {
      now[c.id] = c;
      const auto before = last.find(c.id);
      if (before == last.end()) continue;
      ++lived;
      EXPECT_LE(glm::distance(c.p_S, before->second.p_S), options.point_m_per_s * kTick + 1e-12);
      EXPECT_LE(std::acos(std::min(1.0, glm::dot(c.nhat_ST_S, before->second.nhat_ST_S))),
                options.slew_rad_per_s * kTick + 1e-7);
      EXPECT_LE(std::abs(c.depth_m - before->second.depth_m), fastest + options.depth_creep_m_per_s * kTick + 1e-12);
    }
    last = std::move(now);
  }
  EXPECT_GT(lived, 4000U);
}

// Between two clusters, and near both, a pair that trembles stays with one of them; where it comes clearly nearer to
// the other it changes once.
TEST(Clustering, APairBetweenTwoClustersDoesNotChangeItsMindAtEveryTremor) {
  Clustering clustering;
  const double radius_m = ClusteringOptions{}.radius_in_tolerances * kTolerance;
  std::vector<ProximityPair> pairs;
  for (std::uint32_t i = 0; i < 200; ++i)
    pairs.push_back(pair_at(i, 0, {i % 2 == 0 ? -0.8 * radius_m : 0.8 * radius_m, 0, 0}, {0, 0, 1}, 0.001));
  pairs.push_back({});
  const auto changes_along = [&](const auto& x_at) {
    std::uint32_t last = 0;
    int changes = 0;
    for (int tick = 0; tick < 200; ++tick) {
      pairs.back() = pair_at(200, 0, {x_at(tick), 0, 0}, {0, 0, 1}, 0.0049);
      const auto clusters = clustering.update(pairs, kTolerance, kTick);
      EXPECT_EQ(clusters.size(), 2U);
      const std::uint32_t first = clusters[0].id < clusters[1].id ? clusters[0].pairs : clusters[1].pairs;
      changes += tick > 0 && first != last ? 1 : 0;
      last = first;
    }
    return changes;
  };
  EXPECT_EQ(changes_along([&](int tick) { return (tick % 2 == 0 ? 0.02 : -0.02) * radius_m; }), 0);
  EXPECT_EQ(changes_along([&](int tick) { return (-0.4 + 0.004 * tick) * radius_m; }), 1);
}

}  // namespace
}  // namespace farfeel::contact
