#include "haptic_core/contact/depth/coarse_depth.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "haptic_core/contact/penalty.h"
#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::contact {
namespace {

using contact_service::ContactService;
using spatial::Pose;

const contact::Material kSmooth{.static_friction = 0, .dynamic_friction = 0};

ContactService service_of(const geometry::HapticSurface& s, const geometry::HapticSurface& t, double tolerance_m) {
  const contact_service::TouchableObject object{.felt = &s, .material = kSmooth, .X_WO = {}};
  return {{&object, 1}, {.felt = &t, .material = kSmooth, .X_WO = {}}, {.tolerance_m = tolerance_m}};
}

double energy_J(const ContactSet& set) {
  double sum = 0;
  for (std::uint32_t i = 0; i < set.count; ++i) sum += penalty_energy_J(set.contacts[i]);
  return sum;
}

Contact at_depth(double depth_m) {
  Contact contact;
  contact.depth_m = depth_m;
  contact.gradient << 0, 0, 0, 0, 0, -1;
  return contact;
}

TEST(CoarseDepth, TheFloorTakesOverWithoutAStepAndItsGradientIsTheDepths) {
  const DepthSource coarse{0.3e-3, (spatial::Vector6() << 0, 0, 0, 0.6, 0, -0.8).finished(), {0, 0, 0}};
  constexpr double kWidth_m = 10e-6, kMargin_m = 0.1e-3, kStep_m = 1e-7;
  double before_m = 0;
  for (int i = 0; i < 4000; ++i) {
    const double depth_m = 0.4e-3 - kStep_m * i;
    Contact contact = at_depth(depth_m), next = at_depth(depth_m - kStep_m);
    const double share = keep_above(contact, coarse, coarse.depth_m - kMargin_m, kWidth_m, {}, true);
    keep_above(next, coarse, coarse.depth_m - kMargin_m, kWidth_m, {}, true);
    EXPECT_GE(contact.depth_m, coarse.depth_m - kMargin_m);
    EXPECT_NEAR((contact.depth_m - next.depth_m) / kStep_m, 1 - share, 5e-3);  // how much of the given depth is felt
    EXPECT_NEAR(contact.gradient[3], 0.6 * share, 1e-6);
    if (i > 0) {
      EXPECT_LT(std::abs(contact.depth_m - before_m), 1.01 * kStep_m);
    }
    before_m = contact.depth_m;
  }
}

TEST(CoarseDepth, AnAbsurdDepthLeavesTheFloorExact) {
  const DepthSource coarse{0.3e-3, (spatial::Vector6() << 0, 0, 0, 0, 0, -1).finished(), {0, 0, 0}};
  for (const double absurd_m : {-1.0, -1e9, -1e300}) {
    Contact contact = at_depth(absurd_m);
    EXPECT_EQ(keep_above(contact, coarse, 0.2e-3, 10e-6, {}, true), 1);
    EXPECT_NEAR(contact.depth_m, 0.2e-3, 1e-15);
  }
}

// At an edge what is apart is as far as the coarse pieces; the floor never falls as they come nearer, and what pushes
// there pushes by what is sure.
TEST(CoarseDepth, AtAnEdgeTheGapIsThatOfTheCoarsePieces) {
  constexpr double kWidth_m = 10e-6, kMargin_m = 0.15e-3;
  double before_m = -1;
  for (int um = -800; um <= 800; ++um) {
    const DepthSource coarse{1e-6 * um, spatial::Vector6::Zero(), {0, 0, 0}};
    const double floor_m = least_depth_m(coarse, kMargin_m, kWidth_m, true),
                 inside_m = least_depth_m(coarse, kMargin_m, kWidth_m, false);
    EXPECT_NEAR(inside_m, coarse.depth_m - kMargin_m, 1e-15);
    EXPECT_GE(floor_m, before_m);
    EXPECT_LE(floor_m - before_m, um == -800 ? 1 : 1.01e-6);
    EXPECT_GE(floor_m, inside_m);
    if (um <= 0) {
      EXPECT_NEAR(floor_m, coarse.depth_m, 0.031e-3);
    }
    if (floor_m > 0) {
      EXPECT_EQ(floor_m, inside_m);
    }
    before_m = floor_m;
  }
}

TEST(CoarseDepth, OnlyTheNearestPairConfirmsAGap) {
  std::array<collision::ProximityPair, 2> pairs{};
  pairs[0].distance_m = 0.5e-3, pairs[1].distance_m = 1.5e-3;
  EXPECT_TRUE(confirms_gap(pairs, -0.5e-3));
  EXPECT_TRUE(confirms_gap(pairs, -0.55e-3));
  EXPECT_FALSE(confirms_gap(pairs, -0.7e-3));
  EXPECT_FALSE(confirms_gap(pairs, -1.5e-3));
  pairs[1].distance_m = -0.3e-3;  // something overlaps, whoever's contact that is
  EXPECT_FALSE(confirms_gap(pairs, -0.5e-3));
  EXPECT_FALSE(confirms_gap(pairs, 0.3e-3));
  EXPECT_FALSE(confirms_gap({}, -0.5e-3));
}

// A needle shows a plate nothing but its flanks, until it leans. Energy changes no faster than its motion explains.
TEST(CoarseDepth, ALeaningNeedleIsFeltThroughout) {
  const geometry::HapticSurface plate = slave_sim::height_plate([](double, double) { return 0.0; }, {});
  const geometry::HapticSurface needle = support::untextured(support::cone_mesh(0.3, 0.010, 24));
  ContactService service = service_of(plate, needle, 2e-3);
  double before_J = 0;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const Pose X_WT{spatial::rotation_from_vector({0, 0.002 * i, 0}), {0, 0, -0.3e-3}};
    const ContactSet& set = service.answer({.sequence = i, .time_ns = i * 1'000'000LL, .X_WT = X_WT, .V_WT_W = {}});
    ASSERT_EQ(set.count, 1u);
    EXPECT_GT(set.F_To_W.force_N.z, 0.01) << i;
    const double now_J = energy_J(set);
    if (i > 0) {
      EXPECT_LT(std::abs(now_J - before_J), 8e-6) << i;
    }  // of 45 uJ at the exact depth
    before_J = now_J;
  }
}

// Along the axis a thread covers itself: no height field. The nut is pushed back all the same.
TEST(CoarseDepth, ANutIsPushedBackAlongItsBolt) {
  const support::Thread thread{.turns = 3, .sides = 16};
  const geometry::HapticSurface bolt = support::untextured(support::bolt_mesh(thread)),
                                nut = support::untextured(support::nut_mesh(thread, 0.1e-3, 1));
  for (const double side : {1.0, -1.0}) {
    ContactService service = service_of(bolt, nut, 1e-3);
    const ContactSet& set = service.answer({.X_WT = {{1, 0, 0, 0}, {0, 0, side * 0.4e-3}}, .V_WT_W = {}});
    ASSERT_TRUE(spatial::is_finite(set.F_To_W));
    EXPECT_LT(side * set.F_To_W.force_N.z, -0.05);
    EXPECT_LT(std::hypot(set.F_To_W.force_N.x, set.F_To_W.force_N.y), 0.5 * std::abs(set.F_To_W.force_N.z));
  }
}

TEST(CoarseDepth, APegIsPushedBackToTheMiddleOfItsHole) {
  const geometry::HapticSurface hole = support::untextured(support::tube_mesh(0.010, 0.016, 0.020, 32)),
                                peg = support::untextured(support::cylinder_mesh(0.0099, 0.030, 32));
  ContactService service = service_of(hole, peg, 2e-3);
  for (std::uint32_t i = 0; i < 100; ++i) {  // once round, pressed against the wall
    const double angle = 0.063 * i;
    const glm::dvec3 aside{std::cos(angle), std::sin(angle), 0};
    const Pose X_WT{{1, 0, 0, 0}, 0.25e-3 * aside};
    const ContactSet& set = service.answer({.sequence = i, .time_ns = i * 10'000'000LL, .X_WT = X_WT, .V_WT_W = {}});
    ASSERT_TRUE(spatial::is_finite(set.F_To_W));
    EXPECT_GT(glm::dot(set.F_To_W.force_N, -aside), 0.84 * glm::length(set.F_To_W.force_N)) << i;  // 32 degrees
  }
}

}  // namespace
}  // namespace farfeel::contact
