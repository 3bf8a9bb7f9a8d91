// A small motion changes the answer a little: over random motions, for pairs (distance moves no farther than any point
// of the tool) and for clusters (count, point, direction and depth). And neither query nor clustering allocates.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/tracking/clustering.h"
#include "tests/support/realtime_guard.h"

namespace farfeel {
namespace {

using glm::dvec3;

constexpr double kTolerance_m = 0.005, kTick_s = 0.001;

// A wavy plate, one quadrilateral a piece; upwards is outwards.
geometry::HapticSurface wavy_plate(double side_m, int cells, double height_m, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-height_m, height_m);
  geometry::HapticSurface plate;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const dvec3 p(side_m * (double(i) / cells - 0.5), side_m * (double(j) / cells - 0.5), uniform(random));
      plate.coarse.positions_O.emplace_back(glm::vec3(p));
    }
  }
  const auto at = [&](int i, int j) { return std::uint32_t(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      plate.coarse.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      plate.coarse.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      plate.triangle_piece.insert(plate.triangle_piece.end(), 2, plate.piece_count++);
    }
  }
  return plate;
}

// Strides of at most `stride`: the tool, upside down, wanders over the plate.
class Wanderer {
 public:
  Wanderer(unsigned seed, double stride_m) : random_(seed), stride_m_(stride_m) {}
  spatial::Pose next() {
    for (int k = 0; k < 3; ++k) {
      v_[k] = std::clamp(v_[k] + 0.2 * uniform_(random_), -1.0, 1.0);
      w_[k] = std::clamp(w_[k] + 0.2 * uniform_(random_), -1.0, 1.0);
      p_[k] += 0.5 * stride_m_ * v_[k], a_[k] += 10 * stride_m_ * w_[k];
      const double limit = k < 2 ? 0.03 : 0.004;
      if (std::abs(p_[k]) > limit) p_[k] = std::copysign(limit, p_[k]), v_[k] = -v_[k];
      if (std::abs(a_[k]) > 0.15) a_[k] = std::copysign(0.15, a_[k]), w_[k] = -w_[k];
    }
    return {spatial::rotation_from_vector(a_) * spatial::rotation_from_vector({M_PI, 0, 0}), p_};
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  double stride_m_;
  dvec3 p_{0, 0, 0.003}, v_{0}, a_{0}, w_{0};
};

double largest_step(const geometry::HapticSurface& tool, const spatial::Pose& from, const spatial::Pose& to) {
  double most = 0;
  for (const dvec3& p : tool.coarse.positions_O) {
    most = std::max(most, glm::distance(spatial::transform_point(from, p), spatial::transform_point(to, p)));
  }
  return most;
}

TEST(SmallMotion, ChangesDistancesAndClustersALittle) {
  const auto S = wavy_plate(0.1, 12, 0.001, 1), T = wavy_plate(0.04, 6, 0.001, 2);
  const collision::HullTree s{collision::ConvexPieces(S)}, t{collision::ConvexPieces(T)};
  std::uint64_t distances = 0, lived = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    collision::ProximityQuery query(s, t);
    const contact::ClusteringOptions options;
    contact::Clustering clustering(options);
    Wanderer wanderer(seed, 2e-5);
    std::map<std::uint64_t, collision::ProximityPair> last_pairs;
    std::map<std::uint32_t, contact::Cluster> last_clusters;
    spatial::Pose last = wanderer.next();
    for (int tick = 0; tick < 400; ++tick) {
      const spatial::Pose now = wanderer.next();
      const double step = largest_step(T, last, now);
      last = now;
      std::map<std::uint64_t, collision::ProximityPair> pairs;
      double fastest = 0;
      const auto near = query.nearer_than(kTolerance_m, now);
      for (const auto& pair : near) {
        const std::uint64_t key = std::uint64_t(pair.piece_s) << 32 | pair.piece_t;
        pairs[key] = pair;
        const auto before = last_pairs.find(key);
        if (before == last_pairs.end()) continue;
        const double change = std::abs(pair.distance_m - before->second.distance_m);
        fastest = std::max(fastest, change);
        // The least translation is restricted to directions that turn with the tool; apart there is no such limit.
        if (pair.distance_m < 0 || before->second.distance_m < 0) continue;
        ++distances;
        EXPECT_LE(change, step + 1e-12);
      }
      std::map<std::uint32_t, contact::Cluster> clusters;
      for (const auto& c : clustering.update(near, kTolerance_m, kTick_s)) {
        clusters[c.id] = c;
        const auto before = last_clusters.find(c.id);
        if (before == last_clusters.end()) continue;
        ++lived;
        EXPECT_LE(glm::distance(c.p_S, before->second.p_S), options.point_m_per_s * kTick_s + 1e-12);
        EXPECT_GE(glm::dot(c.nhat_ST_S, before->second.nhat_ST_S), std::cos(options.slew_rad_per_s * kTick_s) - 1e-9);
        EXPECT_LE(std::abs(c.depth_m - before->second.depth_m),
                  fastest + options.depth_creep_m_per_s * kTick_s + 1e-12);
      }
      if (tick > 0) {
        const auto difference = std::abs(int(clusters.size()) - int(last_clusters.size()));
        EXPECT_LE(difference, 2) << "seed " << seed << " tick " << tick;
      }
      last_pairs = std::move(pairs), last_clusters = std::move(clusters);
    }
  }
  EXPECT_GT(distances, 10'000U);
  EXPECT_GT(lived, 4'000U);
}

// Flat plates of a side of 40 mm upright at x, each facing along +x or -x.
geometry::HapticSurface upright(std::initializer_list<std::pair<double, double>> places_and_facings) {
  geometry::HapticSurface all;
  for (const auto& [x_m, facing] : places_and_facings) {
    const auto plate = wavy_plate(0.04, 5, 0, 1);
    const auto first = std::uint32_t(all.coarse.positions_O.size());
    for (const dvec3& p : plate.coarse.positions_O) all.coarse.positions_O.emplace_back(x_m, p.y, -facing * p.x);
    for (const auto& [a, b, c] : plate.coarse.triangles) {
      all.coarse.triangles.push_back({first + a, first + b, first + c});
    }
    for (const std::uint32_t piece : plate.triangle_piece) all.triangle_piece.push_back(all.piece_count + piece);
    all.piece_count += plate.piece_count;
  }
  return all;
}

// A block in a slot, near or in both walls: their directions are never averaged, and contacts keep their names while it
// shakes where it is.
TEST(SmallMotion, KeepsOpposedWallsApartAndTheirContactsAlive) {
  const auto S = upright({{-0.01, 1}, {0.01, -1}}), T = upright({{-0.0095, -1}, {0.0095, 1}});
  const collision::HullTree s{collision::ConvexPieces(S)}, t{collision::ConvexPieces(T)};
  for (unsigned seed = 1; seed <= 4; ++seed) {
    collision::ProximityQuery query(s, t);
    contact::Clustering clustering;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::uint32_t first_id = 0, last_id = 0;
    int both = 0;
    dvec3 where(0);
    for (int tick = 0; tick < 600; ++tick) {
      if (tick < 300) where = 0.995 * where + 4e-5 * dvec3(uniform(random), 4 * uniform(random), 4 * uniform(random));
      const dvec3 shake = 2e-5 * dvec3(uniform(random), uniform(random), uniform(random));
      const spatial::Pose X_ST{spatial::rotation_from_vector(100.0 * shake), where + shake};
      bool is_left = false, is_right = false;
      for (const auto& c : clustering.update(query.nearer_than(0.002, X_ST), 0.002, kTick_s)) {
        EXPECT_GT(std::abs(c.nhat_ST_S.x), 0.9) << "seed " << seed << " tick " << tick;
        (c.nhat_ST_S.x > 0 ? is_left : is_right) = true;
        last_id = std::max(last_id, c.id);
      }
      both += is_left && is_right;
      if (tick == 310) first_id = last_id;
    }
    EXPECT_EQ(both, 600) << "seed " << seed;
    EXPECT_LE(last_id - first_id, 2U) << "new names while it only shook, seed " << seed;
  }
}

TEST(SmallMotion, IsAnsweredWithoutAllocating) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need the allocator themselves";
  const auto S = wavy_plate(0.1, 12, 0.001, 1), T = wavy_plate(0.04, 6, 0.001, 2);
  const collision::HullTree s{collision::ConvexPieces(S)}, t{collision::ConvexPieces(T)};
  collision::ProximityQuery query(s, t);
  contact::Clustering clustering;
  Wanderer wanderer(3, 2e-4);
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  for (int tick = 0; tick < 1000; ++tick) {
    const spatial::Pose X_ST = wanderer.next();
    const test_support::RealtimeGuard guard;
    const auto pairs = query.nearer_than(kTolerance_m, X_ST);
    (void)clustering.update(pairs, kTolerance_m, kTick_s);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
}

}  // namespace
}  // namespace farfeel
