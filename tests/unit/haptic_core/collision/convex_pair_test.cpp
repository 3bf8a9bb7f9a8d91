// Every pair against the oracle: random and hard, at scales from a millimetre to a kilometre.
#include "haptic_core/collision/convex_pair.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "haptic_core/collision/convex_pieces.h"
#include "tests/support/exact_proximity.h"

namespace farfeel::collision {
namespace {

using glm::dvec3;
using support::PointHull;

struct Built {
  explicit Built(const PointHull& h) { pieces.add_piece(h.points, h.outwards); }
  HullShape shape() const { return pieces.shape(0); }
  HullVertices vertices() const { return shape().vertices; }
  ConvexPieces pieces;
};

/// How far a place is from a hull that is given by its points.
double beside(const PointHull& hull, const dvec3& p) {
  return support::exact_proximity({.points = hull.points, .outwards = {}, .triangles = hull.triangles},
                                  {.points = {p}, .outwards = {}, .triangles = {}})
      .plain_distance_m;
}

void expect_exact(const PointHull& A, const PointHull& B, double scale, const std::string& what) {
  const support::ExactProximity truth = support::exact_proximity(A, B);
  const Built a(A), b(B);
  const double rounding = 1e-12 * scale, tolerance = 1e-11 * scale;
  PairSimplex simplex;
  const Separation apart = separation(a.vertices(), b.vertices(), 1e300, rounding, simplex);
  if (apart.apartness == Apartness::kApart) {
    EXPECT_NEAR(apart.distance_m, truth.distance_m, tolerance) << what;
    EXPECT_NEAR(glm::distance(apart.p_a, apart.p_b), apart.distance_m, tolerance) << what;
    return;
  }
  EXPECT_LE(truth.distance_m, tolerance) << what;
  TranslationAxis axis;
  TranslationScratch scratch(1000, 1000);
  const PlacedPair pair{a.shape(), b.shape(), a.vertices(), b.vertices(), {}};
  const LeastTranslation overlap = least_translation(pair, axis, scratch);
  EXPECT_NEAR(-overlap.depth_m, truth.distance_m, tolerance) << what;
  EXPECT_EQ(overlap.is_admissible, truth.is_admissible) << what;
  EXPECT_NEAR(glm::length(overlap.direction), 1, 1e-12) << what;
  EXPECT_NEAR(support::overlap_along(A, B, overlap.direction), overlap.depth_m, tolerance) << what;
  EXPECT_NEAR(glm::dot(overlap.p_a - overlap.p_b, overlap.direction), overlap.depth_m, tolerance) << what;
  EXPECT_LE(beside(A, overlap.p_a), 1e-9 * scale) << what;
  EXPECT_LE(beside(B, overlap.p_b), 1e-9 * scale) << what;
}

class ConvexPair : public ::testing::Test {
 protected:
  double uniform(double low = -1, double high = 1) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  dvec3 vector() { return {uniform(), uniform(), uniform()}; }
  PointHull cloud(int count, bool flat) {
    PointHull h;
    const dvec3 u = vector(), v = vector();
    for (int i = 0; i < count; ++i) h.points.push_back(flat ? uniform() * u + uniform() * v : vector());
    return h;
  }
  // A patch faces where some of its triangles face.
  void face_somewhere(PointHull& h) {
    const dvec3 n = glm::normalize(vector());
    for (int i = 0; i < 3; ++i) h.outwards.push_back(glm::normalize(n + 0.4 * vector()));
  }
  std::mt19937 random_{11};
};

PointHull moved(PointHull h, double scale, const dvec3& by) {
  for (dvec3& p : h.points) p = scale * (p + by);
  return h;
}

TEST_F(ConvexPair, RandomHullsMatchTheOracle) {
  for (int round = 0; round < 600; ++round) {
    const double scale = std::pow(10.0, round % 7 - 3);
    PointHull A = cloud(1 + round % 8, round % 3 == 0), B = cloud(1 + round / 8 % 8, round % 5 == 0);
    if (round % 2 == 0) face_somewhere(A);
    if (round % 4 < 2) face_somewhere(B);
    const dvec3 by = uniform(0, 2.2) * vector();
    expect_exact(moved(A, scale, dvec3(0)), moved(B, scale, by), scale, "round " + std::to_string(round));
  }
}

TEST_F(ConvexPair, LatticeHullsMatchTheOracle) {
  std::uniform_int_distribution<int> cell(0, 2);
  for (int round = 0; round < 600; ++round) {
    PointHull A, B;
    for (int i = 0; i < 1 + round % 8; ++i) A.points.emplace_back(cell(random_), cell(random_), cell(random_));
    for (int i = 0; i < 1 + round / 8 % 8; ++i) B.points.emplace_back(cell(random_), cell(random_), cell(random_));
    const dvec3 by(cell(random_), cell(random_), cell(random_));
    expect_exact(A, moved(B, 1, by), 1, "round " + std::to_string(round));
  }
}

// Who asks only whether a guess parts two hulls hears what the search for a translation of nothing would end with.
TEST_F(ConvexPair, IsPartedByAGuessWhereASearchWouldEndThere) {
  int parted = 0, others = 0;
  for (int i = 0; i < 3000; ++i) {
    PointHull A = cloud(4 + i % 9, i % 3 == 0), B = moved(cloud(4 + i % 7, i % 5 == 0), 1, 1.2 * vector());
    face_somewhere(A), face_somewhere(B);
    const Built a(A), b(B);
    const PlacedPair pair{a.shape(), b.shape(), a.vertices(), b.vertices(), {}};
    TranslationScratch scratch(1000, 1000);
    TranslationAxis axis;
    EXPECT_FALSE(is_parted_by(pair, axis, scratch));
    (void)least_translation(pair, axis, scratch, i % 2 == 0 ? 0 : -1e300);
    const TranslationAxis guess = axis;
    const bool is_parted = is_parted_by(pair, guess, scratch);
    const LeastTranslation found = least_translation(pair, axis, scratch, 0);
    ++(is_parted ? parted : others);
    EXPECT_EQ(is_parted, found.is_admissible && found.depth_m <= 0) << i;
    if (!is_parted) continue;
    EXPECT_EQ(axis.kind, guess.kind);
    EXPECT_EQ(axis.a, guess.a);
    EXPECT_EQ(axis.b, guess.b);
  }
  EXPECT_GT(parted, 300);
  EXPECT_GT(others, 300);
}

}  // namespace
}  // namespace farfeel::collision
