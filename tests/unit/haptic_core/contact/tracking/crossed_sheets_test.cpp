#include "haptic_core/contact/tracking/crossed_sheets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/collision/hull_support.h"
#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/cluster.h"
#include "tests/support/sheets.h"

namespace farfeel::contact {
namespace {

using collision::ConvexPieces;
using collision::HullTree;
using collision::ProximityPair;
using collision::ProximityQuery;

constexpr double kTolerance_m = 5e-3;
constexpr std::uint32_t kTop = 5, kBottom = 4;  // pieces of a box of sheets

/// The slow obvious one: of many directions that lead out of both, the one with the least overlap.
double least_overlap_m(const ConvexPieces& s, const ConvexPieces& t, const ProximityPair& pair,
                       const spatial::Pose& X_ST) {
  constexpr int kRings = 60, kAround = 90;
  constexpr double kReach_rad = 0.6;  // about nhat: farther away these sheets only overlap more
  double least_m = 1;
  const glm::dquat R_SN = spatial::frame_with_z(pair.nhat_ST_S);
  const auto reach_m = [](const ConvexPieces& pieces, std::uint32_t piece, const glm::dvec3& d_O) {
    return collision::reach_along(pieces.vertices(piece), d_O) + glm::dot(d_O, pieces.centre_O);
  };
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) {
      const double polar = kReach_rad * ring / kRings, turn = 2 * M_PI * k / kAround;
      const glm::dvec3 d_S =
          R_SN * glm::dvec3{std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)};
      const glm::dvec3 d_T = glm::conjugate(X_ST.R) * d_S;
      if (collision::outwardness(s.outwards(pair.piece_s), d_S) < 0 ||
          collision::outwardness(t.outwards(pair.piece_t), -d_T) < 0)
        continue;
      least_m =
          std::min(least_m, reach_m(s, pair.piece_s, d_S) + reach_m(t, pair.piece_t, -d_T) - glm::dot(d_S, X_ST.p));
    }
  }
  return least_m;
}

class Pressed {
 public:
  /// The tool's bottom against the table's top.
  const ProximityPair* pair_at(const spatial::Pose& X_ST) {
    for (const ProximityPair& pair : crossed_.mended(query_.nearer_than(kTolerance_m, X_ST), kTolerance_m, X_ST)) {
      if (pair.piece_s == kTop && pair.piece_t == kBottom) return &pair;
    }
    return nullptr;
  }
  const geometry::HapticSurface table = support::box_of_sheets({0.06, 0.05, 0.03}, 0.2e-3),
                                tool = support::box_of_sheets({0.03, 0.02, 0.02}, 0.3e-3);
  const HullTree S{ConvexPieces(table)}, T{ConvexPieces(tool)};

 private:
  ProximityQuery query_{S, T};
  CrossedSheets crossed_{table, S, tool, T};
};

TEST(CrossedSheets, AreAsDeepAsTheLeastWayOutOfBoth) {
  Pressed pressed;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int crossed = 0;
  for (int i = 0; i < 60; ++i) {
    const spatial::Pose X_ST{
        spatial::rotation_from_vector({0.03 * uniform(random), 0.03 * uniform(random), 3 * uniform(random)}),
        {0.01 * uniform(random), 0.01 * uniform(random), 0.025 - 1.5e-3 - 1.2e-3 * uniform(random)}};
    const ProximityPair* pair = pressed.pair_at(X_ST);
    if (!pair || pair->distance_m >= 0) continue;
    ++crossed;
    const double least_m = least_overlap_m(pressed.S.pieces(), pressed.T.pieces(), *pair, X_ST);
    EXPECT_LE(-pair->distance_m, least_m + 1e-12) << i;
    EXPECT_NEAR(-pair->distance_m, least_m, 0.1e-3) << i << ": the directions tried are 0.01 rad apart";
    EXPECT_NEAR(glm::dot(pair->p_St_S - pair->p_Ss_S, pair->nhat_ST_S), pair->distance_m, 1e-9);
  }
  EXPECT_GT(crossed, 30);
}

// While they meet a proximity query tells how deep they are, and once they have passed through, the mended pair: along
// paths that press, tilt and slide through where one takes over from the other, nothing jumps.
TEST(CrossedSheets, DoNotJumpWhereTheyPassThrough) {
  Pressed pressed;
  for (int path = 0; path < 20; ++path) {
    double last_m = -1;
    int passed = 0;
    bool was_there = false;
    for (int i = 0; i <= 2000; ++i) {
      const double press_m = 1e-6 * i;
      const spatial::Pose X_ST{
          spatial::rotation_from_vector({0.02 * std::sin(path), 0.03 * std::cos(2.0 * path) + 2e-6 * i, 0.3 * path}),
          {2e-6 * i, 1e-6 * i, 0.0257 - press_m}};
      const ProximityPair* pair = pressed.pair_at(X_ST);
      ASSERT_TRUE(pair);
      const double depth_m = -pair->distance_m;
      if (was_there && pair->facing > 0.5) {
        EXPECT_LT(std::abs(depth_m - last_m), 60e-6) << path << " at " << press_m;  // 3 um of way, 30 mm of turned arm
        ++passed;
      }
      last_m = depth_m, was_there = pair->facing > 0.5;
    }
    EXPECT_GT(passed, 500) << path;
    EXPECT_GT(last_m, 0.5e-3) << path;
  }
}

// What is remembered of a pair, and what is not looked at because it would count for nothing, changes no answer.
TEST(CrossedSheets, AreTheSameWhateverWasThereBefore) {
  Pressed pressed;
  ProximityQuery query(pressed.S, pressed.T);
  CrossedSheets warm(pressed.table, pressed.S, pressed.tool, pressed.T);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int mended = 0;
  for (int path = 0; path < 60; ++path) {
    const glm::dvec3 turn{0.3 * uniform(random), 0.3 * uniform(random), 3 * uniform(random)};
    const double fast = path % 3 == 0 ? 10 : 1;  // so that sheets come to face each other, or cease to
    const glm::dvec3 turning = fast * glm::dvec3{uniform(random), uniform(random), uniform(random)};
    const glm::dvec3 from{0.03 * uniform(random), 0.025 * uniform(random), 0.023 + 3e-3 * uniform(random)};
    const glm::dvec3 way{0.01 * uniform(random), 0.01 * uniform(random), 4e-3 * uniform(random)};
    for (int i = 0; i < 100; ++i) {
      const double at = 0.01 * i;
      const spatial::Pose X_ST{spatial::rotation_from_vector(turn + 0.2 * at * turning), from + at * way};
      const auto pairs = query.nearer_than(kTolerance_m, X_ST);
      const auto found = warm.mended(pairs, kTolerance_m, X_ST);
      CrossedSheets cold(pressed.table, pressed.S, pressed.tool, pressed.T);
      const auto expected = cold.mended(pairs, kTolerance_m, X_ST);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t k = 0; k < found.size(); ++k) {
        mended += found[k].distance_m != pairs[k].distance_m;
        EXPECT_NEAR(found[k].distance_m, expected[k].distance_m, 1e-12);
        EXPECT_NEAR(found[k].facing, expected[k].facing, 1e-6);
      }
    }
  }
  EXPECT_GT(mended, 300);
}

TEST(CrossedSheets, FadeBeforeThePairIsLostSightOf) {
  Pressed pressed;
  double last = 1;
  for (int i = 0; i <= 3500; ++i) {
    const ProximityPair* pair = pressed.pair_at({{1, 0, 0, 0}, {0, 0, 0.0240 - 2e-6 * i}});
    const double counts = pair && pair->distance_m < 0 ? squareness(pair->facing) : 0;
    EXPECT_LT(std::abs(counts - last), 0.05) << i;
    last = counts;
  }
  EXPECT_EQ(last, 0);
}

}  // namespace
}  // namespace farfeel::contact
