// Contacts that are no height field: when they are noticed, and what points of the displaced surfaces make of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/depth/points/point_fallback.h"
#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/penetration/back_end.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/realtime_guard.h"
#include "tests/support/solids.h"
#include "tests/support/textured_solids.h"
#include "tests/unit/haptic_core/contact/depth/points/point_foot.h"

namespace farfeel::contact {
namespace {

using spatial::Pose;
using spatial::Vector6;

constexpr double kTolerance_m = 0.5e-3, kWidth_m = 10e-6, kClearance_m = 0.1e-3;
/// Flanks 60 degrees steep, as metric threads have: along its axis they lie above each other.
const support::Thread kThread{
    .radius_m = 4e-3, .depth_m = 1.3e-3, .pitch_m = 1.5e-3, .turns = 2, .sides = 8, .steps = 4};

double ridges_m(const glm::dvec3& p) {
  return 0.02e-3 * (std::cos(2 * std::numbers::pi * std::hypot(p.x, p.y) / 0.5e-3) - 1);
}

struct Screw {
  geometry::HapticSurface bolt = support::textured(support::bolt_mesh(kThread), ridges_m),
                          nut = support::textured(support::nut_mesh(kThread, kClearance_m, 1), ridges_m);
};

TEST(StackedPieces, OfAThreadAreItsFlightsAndConvexThingsHaveNone) {
  const geometry::HapticSurface bolt = support::untextured(support::bolt_mesh(kThread)),
                                box = support::untextured(support::box_mesh({0.01, 0.02, 0.005})),
                                tube = support::untextured(support::tube_mesh(0.010, 0.016, 0.020, 24));
  EXPECT_TRUE(StackedPieces(box, 0.05).is_empty());
  EXPECT_TRUE(StackedPieces(tube, 2e-3).is_empty());
  const StackedPieces stacked(bolt, 2e-3);
  EXPECT_FALSE(stacked.is_empty());
  for (std::uint32_t piece = 0; piece < bolt.piece_count; ++piece) {
    for (const std::uint32_t other : stacked.with(piece)) {
      const auto back = stacked.with(other);
      EXPECT_TRUE(std::binary_search(back.begin(), back.end(), piece)) << piece << ' ' << other;
      EXPECT_NE(piece, other);
    }
  }
}

/// All near pairs of a bolt and its nut as one cluster along the axis, `up` for the flanks that hold the nut down.
struct OneCluster {
  OneCluster(const Screw& screw, const Pose& X_ST)
      : tree_s(collision::ConvexPieces(screw.bolt)), tree_t(collision::ConvexPieces(screw.nut)), query(tree_s, tree_t) {
    const auto near = query.nearer_than(kTolerance_m, X_ST);
    pairs.assign(near.begin(), near.end());
    cluster.nhat_ST_S = {0, 0, -1};
    const auto add = [](PieceList& list, std::uint32_t piece) {
      const auto end = list.pieces.begin() + list.count;
      if (list.count < kMaxClusterPieces && std::find(list.pieces.begin(), end, piece) == end)
        list.pieces[list.count++] = piece;
    };
    for (const collision::ProximityPair& pair : pairs)
      add(cluster.pieces_s, pair.piece_s), add(cluster.pieces_t, pair.piece_t);
  }
  collision::HullTree tree_s, tree_t;
  collision::ProximityQuery query;
  std::vector<collision::ProximityPair> pairs;
  Cluster cluster;
};

Pose pulled_up(double sunk_m) {
  const double slope = 2 * kThread.depth_m / kThread.pitch_m;
  return {{1, 0, 0, 0}, {0.01e-3, -0.02e-3, (kClearance_m + sunk_m * std::hypot(1, slope)) / slope}};
}

/// The nut's points against the bolt.
struct PointDepthTest : ::testing::Test {
  const Screw screw;
  const penetration::FeltSurface s{screw.bolt}, t{screw.nut};
  const FacetedSurface facets_s{s}, facets_t{t};
  SurfacePoints points_t{facets_t};
  PointDepth points{facets_s, points_t, kTolerance_m};
};

TEST_F(PointDepthTest, IsWhatDensePointsSayAndTheCoarsePiecesDoNot) {
  const auto all = [](const glm::dvec3&) { return true; };
  const auto inner = [](const glm::dvec3& p) { return std::hypot(p.x, p.y) < kThread.radius_m + kThread.depth_m; };
  const auto dense_s = support::dense_points(screw.bolt, 0.15e-3, all),
             dense_t = support::dense_points(screw.nut, 0.15e-3, inner);
  for (const double sunk_m : {0.1e-3, 0.2e-3}) {
    const Pose X_ST = pulled_up(sunk_m);
    const OneCluster one(screw, X_ST);
    const support::DenseDepth truth =
        support::dense_depth(dense_s, dense_t, X_ST, 0.4e-3, kWidth_m, penetration::kReferenceArea_m2);
    const DepthSource felt = points.evaluate(one.cluster, X_ST, kWidth_m);
    EXPECT_NEAR(felt.depth_m, truth.soft_depth_m, 30e-6) << sunk_m;
    EXPECT_GT(felt.depth_m, 0) << sunk_m;
    const glm::dvec3 way{felt.gradient[3], felt.gradient[4], felt.gradient[5]};
    EXPECT_GT(way.z, 0.5) << "pulled up further it sinks deeper";
    EXPECT_GT(points.points(), 50u);
  }
}

TEST_F(PointDepthTest, GradientIsTheDerivativeAndNothingIsAllocated) {
  for (const double sunk_m : {0.1e-3, 0.17e-3}) {
    const Pose X_ST = pulled_up(sunk_m);
    const OneCluster one(screw, X_ST);
    DepthSource here;
    {
      const test_support::RealtimeGuard guard;
      here = points.evaluate(one.cluster, X_ST, kWidth_m);
    }
    for (int k = 0; k < 6; ++k) {
      const double step = k < 3 ? 1e-5 : 5e-8;
      double depth_m[2];
      for (const int side : {0, 1}) {
        const Vector6 q = (side == 0 ? step : -step) * Vector6::Unit(k);
        const Pose moved{glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * X_ST.R),
                         X_ST.p + glm::dvec3{q[3], q[4], q[5]}};
        depth_m[side] = points.evaluate(one.cluster, moved, kWidth_m).depth_m;
      }
      const double scale = k < 3 ? 5e-3 : 1;  // rotations act at the thread's radius
      EXPECT_NEAR((depth_m[0] - depth_m[1]) / (2 * step), here.gradient[k], 0.02 * scale) << sunk_m << ", " << k;
    }
  }
  if (test_support::RealtimeGuard::is_available()) {
    EXPECT_EQ(test_support::RealtimeGuard::violations(), 0u) << test_support::RealtimeGuard::first_violation();
  }
}

// Along a path, where points pass from one face of the bolt to the next, too.
TEST_F(PointDepthTest, TheGradientsAlongAPathAddUpToTheDepths) {
  const OneCluster one(screw, pulled_up(0.1e-3));
  constexpr int kSteps = 100;
  const auto at = [](int i) {
    const double x = 2e-4 * i / kSteps;
    Pose X_ST = pulled_up(0.05e-3 + 0.3 * x);
    X_ST.p += glm::dvec3{x, 0.5 * x, 0};
    return X_ST;
  };
  double along_m = 0, first_m = 0, last_m = 0, way = 0;
  DepthSource before;
  for (int i = 0; i <= kSteps; ++i) {
    const DepthSource here = points.evaluate(one.cluster, at(i), kWidth_m);
    if (i == 0) first_m = here.depth_m;
    if (i > 0) {
      const Vector6 slope = 0.5 * (here.gradient + before.gradient);
      const double step = glm::dot(glm::dvec3{slope[3], slope[4], slope[5]}, at(i).p - at(i - 1).p);
      along_m += step, way += std::abs(step);
    }
    last_m = here.depth_m, before = here;
  }
  EXPECT_NEAR(along_m, last_m - first_m, 0.01 * way);
}

/// Every point of the cluster's pieces of T against every triangle of S, and all that is found counts.
double depth_of_all_points_m(const FacetedSurface& s, SurfacePoints& t, const Cluster& cluster, const Pose& X_ST) {
  std::vector<std::uint32_t> all(s.size());
  std::iota(all.begin(), all.end(), 0u);
  const auto is_in = [](const PieceList& list, std::uint32_t piece) {
    return std::find(list.view().begin(), list.view().end(), piece) != list.view().end();
  };
  double sum = 0;
  for (std::uint32_t triangle = 0; triangle < t.surface().size(); ++triangle) {
    const FacetedSurface::Facet& tool = t.surface().facet(triangle);
    const glm::dvec3 nhat_S = spatial::rotate(X_ST, tool.nhat_O);
    const double along = std::clamp((-glm::dot(nhat_S, cluster.nhat_ST_S) - 0.05) / 0.3, 0.0, 1.0);
    if (!is_in(cluster.pieces_t, tool.piece) || !(along > 0)) continue;
    for (const glm::dvec3& p_T : t.of(triangle)) {
      const PointFoot foot = foot_of(s, all, spatial::transform_point(X_ST, p_T), nhat_S, kTolerance_m);
      if (!(foot.share > 0) || !is_in(cluster.pieces_s, s.facet(foot.facet).piece)) continue;
      sum += along * along * (3 - 2 * along) * foot.share * tool.area_m2 / t.count(triangle) *
             std::exp(foot.depth_m / kWidth_m);
    }
  }
  return kWidth_m * std::log(sum / penetration::kReferenceArea_m2);
}

// Near and far, at rest and on, in steps that leave most of what is known as it is and in such that leave nothing.
TEST_F(PointDepthTest, IsWhatASearchOfAllPointsAmongAllTrianglesFinds) {
  using penetration::InstructionSet;
  const OneCluster one(screw, pulled_up(0.1e-3));
  std::mt19937 random(5);
  std::normal_distribution<double> any;
  const auto way = [&](double size) { return size * glm::dvec3{any(random), any(random), any(random)}; };
  PointDepth plain{facets_s, points_t, kTolerance_m, InstructionSet::kPlain},
      avx2{facets_s, points_t, kTolerance_m, InstructionSet::kAvx2};
  for (const double sunk_m : {-0.05e-3, 0.05e-3, 0.15e-3}) {
    Pose X_ST = pulled_up(sunk_m);
    for (const double step_m : {0.0, 1e-6, 1e-5, 1e-5, 1e-4}) {
      X_ST = {glm::normalize(spatial::rotation_from_vector(way(step_m / 5e-3)) * X_ST.R), X_ST.p + way(step_m)};
      const double truth_m = depth_of_all_points_m(facets_s, points_t, one.cluster, X_ST);
      for (PointDepth* depth : {&points, &avx2, &plain})
        EXPECT_NEAR(depth->evaluate(one.cluster, X_ST, kWidth_m).depth_m, truth_m, 0.1e-6) << sunk_m << step_m;
    }
  }
}

TEST_F(PointDepthTest, LooksAtFewPointsWhereThePoseHardlyChanges) {
  const OneCluster one(screw, pulled_up(0.1e-3));
  Pose X_ST = pulled_up(0.1e-3);
  static_cast<void>(points.evaluate(one.cluster, X_ST, kWidth_m));
  const std::uint32_t first = points.points();
  static_cast<void>(points.evaluate(one.cluster, X_ST, kWidth_m));
  EXPECT_LT(points.points(), 0.1 * first) << "at the same pose hardly anything is looked at again";
  X_ST.p.z += 1e-6;
  static_cast<void>(points.evaluate(one.cluster, X_ST, kWidth_m));
  EXPECT_LT(points.points(), 0.8 * first);
}

// The bolt's end is a thin wedge over its last groove: a flank of the nut in the groove has the end's face behind it.
TEST(NearestFacets, EqualSurfacesShareOneWhileSomebodyHasIt) {
  const geometry::HapticSurface box = support::untextured(support::box_mesh({0.01, 0.02, 0.005})), again = box,
                                other = support::untextured(support::box_mesh({0.01, 0.02, 0.006}));
  const penetration::FeltSurface felt_box(box), felt_again(again), felt_other(other);
  const FacetedSurface of_box(felt_box), of_again(felt_again), of_other(felt_other);
  auto first = NearestFacets::shared(of_box, 1e-3, 1e-3), second = NearestFacets::shared(of_again, 1e-3, 1e-3);
  EXPECT_EQ(first, second);
  EXPECT_NE(first, NearestFacets::shared(of_other, 1e-3, 1e-3));
  EXPECT_NE(first, NearestFacets::shared(of_box, 2e-3, 1e-3));
  const std::weak_ptr<const NearestFacets> kept = first;
  first.reset(), second.reset();
  EXPECT_TRUE(kept.expired()) << "nobody has it, and it is kept";
}

TEST(PointDepth, WhatLiesBeyondAirIsNotFelt) {
  const Screw screw;
  const penetration::FeltSurface s(screw.bolt);
  const FacetedSurface facets(s);
  std::vector<std::uint32_t> all(facets.size());
  std::iota(all.begin(), all.end(), 0u);
  const double end_m = 0.5 * kThread.turns * kThread.pitch_m;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi), down_m(0.02e-3, 0.4e-3);
  int in_air = 0;
  for (int i = 0; i < 4000; ++i) {
    const double a = angle(random), r_m = kThread.radius_m + kThread.depth_m;
    const glm::dvec3 p{0.99 * r_m * std::cos(a), 0.99 * r_m * std::sin(a), end_m - down_m(random)};
    const bool is_in_air = std::all_of(all.begin(), all.end(), [&](std::uint32_t f) {
      const FlatDistance at = facets.facet(f).distance(p);
      return at.beside_m > 0 || at.above_m > 0 || at.above_m < -0.3e-3;
    });
    if (!is_in_air) continue;
    ++in_air;
    const PointFoot foot = foot_of(facets, all, p, {0, 0, -1}, kTolerance_m);
    EXPECT_FALSE(foot.share > 0 && foot.depth_m > 0) << i;
  }
  EXPECT_GT(in_air, 100);
}

TEST(PointFallback, MixedDepthsHaveTheirOwnDerivativeAsGradient) {
  // Both depths and the floor are linear in the pose: whatever bends is the share's.
  const Vector6 g_field = (Vector6() << 0.001, 0, 0.002, 0.1, 0, -1).finished(),
                g_floor = (Vector6() << 0, 0.001, 0, -0.2, 0.1, -0.9).finished(),
                g_points = (Vector6() << 0.002, 0.001, 0, 0.3, -0.1, -0.8).finished();
  constexpr double kMargin_m = 0.1e-3;
  const auto mixed = [&](const Vector6& q) {
    Contact contact;
    contact.depth_m = 0.1e-3 + g_field.dot(q);
    contact.gradient = g_field;
    const DepthSource floor{0.3e-3 + g_floor.dot(q), g_floor, {}}, points{0.22e-3 + g_points.dot(q), g_points, {}};
    mix_in(contact, share_by_floor(contact, true, floor, kMargin_m, {}), points, 1e-3, {});
    return contact;
  };
  const Contact here = mixed(Vector6::Zero());
  EXPECT_GT(here.depth_m, 0.1e-3);
  EXPECT_LT(here.depth_m, 0.22e-3);
  for (int k = 0; k < 6; ++k) {
    const double step = 1e-8;
    const double change = mixed(step * Vector6::Unit(k)).depth_m - mixed(-step * Vector6::Unit(k)).depth_m;
    EXPECT_NEAR(change / (2 * step), here.gradient[k], 1e-6) << k;
  }
}

TEST(PointFallback, HeightFieldsThatTakeOneFlightForAnotherAreFeltAsPointsContinuously) {
  const Vector6 g_field = (Vector6() << 0.001, 0, 0.002, 0.1, 0, -1).finished(),
                g_coarse = (Vector6() << 0, 0.001, 0, -0.2, 0.1, -0.9).finished();
  constexpr double kMargin_m = 0.1e-3;
  const auto share_at = [&](double deeper_m, const Vector6& q) {
    Contact contact;
    contact.depth_m = 0.2e-3 + kMargin_m + deeper_m + g_field.dot(q);
    contact.gradient = g_field;
    return share_by_ceiling(contact, {0.2e-3 + g_coarse.dot(q), g_coarse, {}}, kMargin_m, {});
  };
  EXPECT_EQ(share_at(-1e-6, Vector6::Zero()).share, 0);
  EXPECT_EQ(share_at(1e-3, Vector6::Zero()).share, 1) << "a flight away";
  const PointShare here = share_at(0.1e-3, Vector6::Zero());
  EXPECT_NEAR(here.share, 0.5, 1e-9);
  for (int k = 0; k < 6; ++k) {
    const double step = 1e-8, change = share_at(0.1e-3, step * Vector6::Unit(k)).share -
                                       share_at(0.1e-3, -step * Vector6::Unit(k)).share;
    EXPECT_NEAR(change / (2 * step), here.gradient[k], 1e-3 * here.gradient.norm()) << k;
  }
}

contact_service::ContactService service_of(const geometry::HapticSurface& s, const geometry::HapticSurface& t,
                                           double tolerance_m) {
  const Material smooth{.static_friction = 0, .dynamic_friction = 0};
  const contact_service::TouchableObject object{.felt = &s, .material = smooth, .X_WO = {}};
  return {{&object, 1}, {.felt = &t, .material = smooth, .X_WO = {}}, {.tolerance_m = tolerance_m}};
}

TEST(PointFallback, AHeightFieldNeedsNoPointsAndAThreadIsNeverFeltThroughItsFlights) {
  const geometry::HapticSurface table = slave_sim::ridged_plate(3e-3, 0.3e-3),
                                tool = slave_sim::ridged_plate(2e-3, 0.2e-3, {.size_m = {0.01, 0.008, 0.004}});
  contact_service::ContactService plates = service_of(table, tool, 5e-3);
  const StageTimes& of_plates = plates.answer({.X_WT = {{0, 1, 0, 0}, {0, 0, -0.1e-3}}, .V_WT_W = {}}).times;
  EXPECT_EQ(of_plates.point_contacts, 0u);
  EXPECT_EQ(of_plates.points, 0u);

  const Screw screw;
  contact_service::ContactService threads = service_of(screw.bolt, screw.nut, kTolerance_m);
  const Answer& set = threads.answer({.X_WT = pulled_up(0.15e-3), .V_WT_W = {}});
  EXPECT_GT(set.times.point_contacts, 0u);
  double deepest_m = -1;
  for (std::uint32_t i = 0; i < set.count; ++i) deepest_m = std::max(deepest_m, set.contacts[i].depth_m);
  EXPECT_GT(deepest_m, 0.1e-3);
  EXPECT_LT(deepest_m, 0.25e-3) << "height fields that take one flight for another say 1 mm and more";
  EXPECT_LT(set.F_To_W.force_N.z, -0.05) << "pushed back down";
}

}  // namespace
}  // namespace farfeel::contact
