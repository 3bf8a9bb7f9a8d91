#include "haptic_core/collision/proximity_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "tests/support/exact_proximity.h"

namespace farfeel::collision {
namespace {

using glm::dvec3;

// A bumpy sphere, two triangles a piece: some pieces are flat, some are not.
geometry::HapticSurface bumpy_sphere(double radius_m, int columns, int rows, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.9, 1.1);
  geometry::HapticSurface surface;
  auto& mesh = surface.coarse;
  mesh.positions_O.emplace_back(0, 0, -radius_m);
  for (int j = 1; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * M_PI * i / columns, b = M_PI * j / rows;
      mesh.positions_O.push_back(dvec3(glm::vec3(
          radius_m * uniform(random) * dvec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), -std::cos(b)))));
    }
  }
  mesh.positions_O.emplace_back(0, 0, radius_m);
  const auto at = [&](int i, int j) { return std::uint32_t(1 + (j - 1) * columns + i % columns); };
  const auto last = std::uint32_t(mesh.positions_O.size() - 1);
  for (int i = 0; i < columns; ++i) {
    mesh.triangles.push_back({0, at(i + 1, 1), at(i, 1)});
    surface.triangle_piece.push_back(surface.piece_count++);
    mesh.triangles.push_back({last, at(i, rows - 1), at(i + 1, rows - 1)});
    surface.triangle_piece.push_back(surface.piece_count++);
    for (int j = 1; j + 1 < rows; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      surface.triangle_piece.insert(surface.triangle_piece.end(), 2, surface.piece_count++);
    }
  }
  return surface;
}

support::PointHull oracle_hull(const geometry::HapticSurface& s, std::uint32_t piece, const spatial::Pose& X) {
  support::PointHull h;
  for (std::size_t t = 0; t < s.coarse.triangles.size(); ++t) {
    if (s.triangle_piece[t] != piece) continue;
    for (const auto v : s.coarse.triangles[t]) h.points.push_back(spatial::transform_point(X, s.coarse.positions_O[v]));
    h.outwards.push_back(spatial::rotate(X, geometry::unit_normal(s.coarse, s.coarse.triangles[t])));
  }
  return h;
}

TEST(ProximityQuery, FindsWhatTheOracleFindsWhileTheToolMoves) {
  const auto S = bumpy_sphere(0.05, 8, 6, 1), T = bumpy_sphere(0.03, 7, 5, 2);
  const HullTree s{ConvexPieces(S)}, t{ConvexPieces(T)};
  ProximityQuery query(s, t);
  const double tolerance_m = 0.004;
  std::size_t overlapping = 0;
  for (int step = 0; step < 12; ++step) {
    const spatial::Pose X_ST{spatial::rotation_from_vector({0.02 * step, 0.3, -0.01 * step}),
                             {0.0005 * step, 0, 0.082 - 0.0006 * step}};
    std::map<std::pair<std::uint32_t, std::uint32_t>, ProximityPair> found;
    for (const ProximityPair& p : query.nearer_than(tolerance_m, X_ST)) found[{p.piece_s, p.piece_t}] = p;
    for (std::uint32_t i = 0; i < S.piece_count; ++i) {
      for (std::uint32_t j = 0; j < T.piece_count; ++j) {
        const auto truth = support::exact_proximity(oracle_hull(S, i, {}), oracle_hull(T, j, X_ST));
        const auto it = found.find({i, j});
        if (std::abs(truth.distance_m - tolerance_m) > 1e-12) {
          ASSERT_EQ(it != found.end(), truth.distance_m < tolerance_m) << i << " " << j;
        }
        if (it == found.end()) continue;
        const ProximityPair& pair = it->second;
        EXPECT_NEAR(pair.distance_m, truth.distance_m, 1e-12);
        EXPECT_NEAR(glm::dot(pair.p_St_S - pair.p_Ss_S, pair.nhat_ST_S), pair.distance_m, 1e-12);
        EXPECT_NEAR(glm::length(pair.nhat_ST_S), 1, 1e-12);
        overlapping += pair.distance_m < 0;
      }
    }
  }
  EXPECT_GT(overlapping, 20U);
  EXPECT_EQ(query.pairs_left_out(), 0U);
}

// How far point p_O is from the plane, line or point of a piece's feature.
double distance_to(const ConvexPieces& pieces, std::uint32_t piece, const HullFeature& feature, const dvec3& p_O) {
  const HullShape hull = pieces.shape(piece);
  const dvec3 p = p_O - pieces.centre_O;
  switch (feature.kind) {
    case HullFeature::Kind::kVertex:
      return glm::distance(p, hull.vertices.at(feature.index));
    case HullFeature::Kind::kEdge: {
      const HullEdge& e = hull.edges[feature.index];
      return glm::length(glm::cross(e.along, p - hull.vertices.at(e.ends[0])));
    }
    default:
      return std::abs(glm::dot(hull.faces.normal(feature.index), p) - hull.faces.offset_m[feature.index]);
  }
}

TEST(ProximityQuery, NamesTheFeaturesThatTheWitnessesLieOn) {
  const auto S = bumpy_sphere(0.05, 10, 8, 1), T = bumpy_sphere(0.03, 9, 7, 2);
  const HullTree s{ConvexPieces(S)}, t{ConvexPieces(T)};
  ProximityQuery query(s, t);
  std::map<std::pair<HullFeature::Kind, HullFeature::Kind>, int> seen;
  for (int step = 0; step < 200; ++step) {
    const spatial::Pose X_ST{spatial::rotation_from_vector({0.004 * step, 0.3, -0.003 * step}),
                             {1e-4 * step, 0, 0.08 - 5e-5 * step}};
    const spatial::Pose X_TS = spatial::inverse(X_ST);
    for (const ProximityPair& pair : query.nearer_than(0.004, X_ST)) {
      EXPECT_LT(distance_to(s.pieces(), pair.piece_s, pair.feature_s, pair.p_Ss_S), 1e-12);
      EXPECT_LT(distance_to(t.pieces(), pair.piece_t, pair.feature_t, spatial::transform_point(X_TS, pair.p_St_S)),
                1e-12);
      ++seen[{pair.feature_s.kind, pair.feature_t.kind}];
    }
  }
  EXPECT_GE(seen.size(), 5U);
}

// Strides from a thousandth of the tool to its size, with stops, reversals and changes of tolerance.
struct Stride {
  spatial::Pose X_ST;
  double tolerance_m;
};
std::vector<Stride> strides(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Stride> all;
  dvec3 p(0, 0, 0.078), v(0), a(0), w(0);
  double stride = 1e-4;
  for (int step = 0; step < 300; ++step) {
    if (step % 40 == 0) stride = std::pow(10.0, -4 + step / 40 % 4);
    if (step % 16 == 0) v = {uniform(random), uniform(random), uniform(random)}, w = 10.0 * v;
    if (step % 50 > 3) p += stride * v, a += stride * w;
    p.z = std::clamp(p.z, 0.07, 0.084), p.x = std::clamp(p.x, -0.02, 0.02), p.y = std::clamp(p.y, -0.02, 0.02);
    all.push_back({{spatial::rotation_from_vector(a), p}, step % 90 < 80 ? 0.004 : 0.002});
  }
  return all;
}

struct Scaled {
  double scale;
  dvec3 away_m;
};

// What the memory of a query is worth must not show in what it answers, nor may the scale or the place.
TEST(ProximityQuery, AnswersTheSameWithoutItsMemoryAtAnyScaleAndPlace) {
  const auto S = bumpy_sphere(0.05, 10, 8, 1), T = bumpy_sphere(0.03, 9, 7, 2);
  const HullTree at_home_s{ConvexPieces(S)}, at_home_t{ConvexPieces(T)};
  for (const Scaled& c :
       {Scaled{1, dvec3(0)}, Scaled{1e-3, dvec3(0)}, Scaled{1e3, dvec3(0)}, Scaled{1, dvec3(1e6, -1e6, 1e6)}}) {
    auto moved_s = S, moved_t = T;
    for (dvec3& p : moved_s.coarse.positions_O) p = c.scale * p + c.away_m;
    for (dvec3& p : moved_t.coarse.positions_O) p = c.scale * p + c.away_m;
    const HullTree s{ConvexPieces(moved_s)}, t{ConvexPieces(moved_t)};
    ProximityQuery warm(s, t), cold(s, t), at_home(at_home_s, at_home_t);
    const double size = 0.1 * c.scale, rounding = 1e-12 * size;
    const double from_place = (c.away_m == dvec3(0) ? 1e-12 : 1e-7) * size;
    std::size_t overlapping = 0, pairs = 0;
    for (const Stride& stride : strides(7)) {
      const spatial::Pose& X = stride.X_ST;
      const spatial::Pose X_ST{X.R, c.scale * X.p + c.away_m - X.R * c.away_m};
      const double tolerance_m = c.scale * stride.tolerance_m;
      cold.restart();
      const auto forgetful = cold.nearer_than(tolerance_m, X_ST);
      const auto home = at_home.nearer_than(stride.tolerance_m, X);
      std::map<std::pair<std::uint32_t, std::uint32_t>, double> plain, unscaled;
      for (const auto& p : forgetful) plain[{p.piece_s, p.piece_t}] = p.distance_m;
      for (const auto& p : home) unscaled[{p.piece_s, p.piece_t}] = c.scale * p.distance_m;
      const auto found = warm.nearer_than(tolerance_m, X_ST);
      ASSERT_EQ(found.size(), plain.size());
      for (const auto& p : found) {
        ASSERT_TRUE(plain.contains({p.piece_s, p.piece_t}));
        EXPECT_NEAR(p.distance_m, (plain[{p.piece_s, p.piece_t}]), rounding);
        if (unscaled.contains({p.piece_s, p.piece_t})) {
          EXPECT_NEAR(p.distance_m, (unscaled[{p.piece_s, p.piece_t}]), from_place);
        } else {
          EXPECT_NEAR(p.distance_m, tolerance_m, from_place);
        }
        EXPECT_NEAR(glm::dot(p.p_St_S - p.p_Ss_S, p.nhat_ST_S), p.distance_m, 1e-15 * glm::length(c.away_m) + rounding);
        overlapping += p.distance_m < 0;
      }
      pairs += found.size();
    }
    EXPECT_GT(pairs, 5000U);
    EXPECT_GT(overlapping, 500U);
  }
}

}  // namespace
}  // namespace farfeel::collision
