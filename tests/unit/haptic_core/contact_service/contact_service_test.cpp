#include "haptic_core/contact_service/contact_service.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/penetration/reference/reference.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::contact_service {
namespace {

using slave_sim::ridged_plate;

const glm::dquat kTurnedOver{0, 1, 0, 0};  // half a turn about x: the tool's plate faces down

/// A ridged plate on the table, its top at z = 0, and a smaller one as the tool.
struct Bench {
  geometry::HapticSurface table = ridged_plate(3e-3, 0.5e-3),
                          tool = ridged_plate(2e-3, 0.3e-3, {.size_m = {0.01, 0.008, 0.004}});
  spatial::Pose X_WO;

  [[nodiscard]] ContactService service(const ContactOptions& options = {}) const {
    const TouchableObject object{.felt = &table, .material = {}, .X_WO = X_WO};
    return {{&object, 1}, {.felt = &tool, .material = {}, .X_WO = {}}, options};
  }
  [[nodiscard]] ToolPose pose(double depth_m, std::uint32_t sequence = 0) const {
    return {.sequence = sequence,
            .time_ns = sequence * 1'000'000LL,
            .X_WT = X_WO * spatial::Pose{kTurnedOver, {0.2e-3, 0.1e-3, -depth_m}},
            .V_WT_W = {}};
  }
};

/// How deep the bench's two profiles overlap, from their formulas: no part of the engine has a say in it.
double overlap_m(double press_m) {
  const auto ridges_m = [](double x_m, double period_m, double height_m) {
    return 0.5 * height_m * (std::cos(2 * std::numbers::pi * x_m / period_m) - 1);
  };
  constexpr double kShift_m = 0.2e-3, kHalfTool_m = 5e-3;
  double most_m = -1;
  for (double x_m = -kHalfTool_m; x_m <= kHalfTool_m; x_m += 1e-6)
    most_m = std::max(most_m, ridges_m(x_m + kShift_m, 3e-3, 0.5e-3) + ridges_m(x_m, 2e-3, 0.3e-3) + press_m);
  return most_m;
}
/// The soft maximum of 10 um lies above the hard one, by less than this over crests that are so long.
constexpr double kSoftening_m = 30e-6;

TEST(ContactService, PressingMeansAForceOutwards) {
  const Bench bench;
  ContactService service = bench.service();
  const Answer& set = service.answer(bench.pose(0.2e-3, 7));
  ASSERT_EQ(set.count, 1u);
  EXPECT_EQ(set.pose_sequence, 7u);
  EXPECT_EQ(set.pairs_near, 1u);
  EXPECT_GT(set.contacts[0].depth_m, 0);
  EXPECT_GE(set.contacts[0].depth_m, overlap_m(0.2e-3) - 1e-6);
  EXPECT_LE(set.contacts[0].depth_m, overlap_m(0.2e-3) + kSoftening_m);
  EXPECT_NEAR(set.contacts[0].nhat_ST_W.z, 1, 1e-6);
  EXPECT_GT(set.F_To_W.force_N.z, 0.05);
  EXPECT_GT(set.times.total_us, 0);
}

TEST(ContactService, WhoAsksForNoWrenchGetsTheSameContactsAndFrictionBeginsAnewAfterwards) {
  const Bench bench;
  ContactService with = bench.service(), without = bench.service();
  for (std::uint32_t i = 0; i < 50; ++i) {
    ToolPose asked = bench.pose(0.2e-3, i);
    asked.X_WT.p.x += 2e-6 * i;
    const Answer& a = with.answer(asked);
    asked.wants_wrench = false;
    const Answer& b = without.answer(asked);
    ASSERT_EQ(a.count, b.count);
    for (std::uint32_t c = 0; c < a.count; ++c) {
      EXPECT_EQ(a.contacts[c].depth_m, b.contacts[c].depth_m);
      EXPECT_EQ(a.contacts[c].gradient, b.contacts[c].gradient);
    }
    EXPECT_NE(a.F_To_W, spatial::Wrench{});
    EXPECT_EQ(b.F_To_W, spatial::Wrench{});
    EXPECT_EQ(b.times.frictions, 0u);
    EXPECT_GT(a.times.frictions, 0u);
  }
}

/// Contacts, names, widths and friction: whatever had been found before.
TEST(ContactService, AfterARestartItAnswersAsANewOne) {
  const Bench bench;
  const ContactOptions options{.most_stiffness_N_per_m = 500};
  ContactService used = bench.service(options), fresh = bench.service(options);
  double widest_m = 0;
  for (std::uint32_t i = 0; i < 100; ++i) {
    ToolPose pose = bench.pose(0.3e-3 + 3e-6 * i, i);
    pose.X_WT.p.x += 10e-6 * i;
    widest_m = used.answer(pose).times.widest_m;
  }
  EXPECT_GT(widest_m, 10e-6) << "there is something to forget";
  used.restart();
  for (std::uint32_t i = 0; i < 20; ++i) {
    ToolPose pose = bench.pose(0.3e-3, i);
    pose.X_WT.p.y += 10e-6 * i;
    const Answer &a = used.answer(pose), &b = fresh.answer(pose);
    ASSERT_EQ(a.count, b.count);
    EXPECT_EQ(a.F_To_W, b.F_To_W) << i;
    EXPECT_EQ(a.times.widest_m, b.times.widest_m) << i;
    EXPECT_EQ(a.times.grids, b.times.grids) << i;
    for (std::uint32_t k = 0; k < a.count; ++k) {
      EXPECT_EQ(a.contacts[k].id, b.contacts[k].id) << i;
      EXPECT_EQ(a.contacts[k].depth_m, b.contacts[k].depth_m) << i;
    }
  }
}

/// The remote's own wrench: F = -(k d + c g.V) g, for who renders it as it comes.
TEST(ContactService, AToolThatComesNearerIsDamped) {
  Bench bench;
  const contact::Material damped{
      .stiffness_N_per_m = 2000, .damping_Ns_per_m = 3, .static_friction = 0, .dynamic_friction = 0};
  const TouchableObject object{.felt = &bench.table, .material = damped, .X_WO = {}};
  const TouchableObject tool{.felt = &bench.tool, .material = damped, .X_WO = {}};
  ToolPose still = bench.pose(0.2e-3), comes = still;
  comes.V_WT_W = {{0.1, 0.2, 0}, {0.002, 0, -0.02}};
  ContactService of_still({&object, 1}, tool, {}), of_comes({&object, 1}, tool, {});
  const contact::ContactSet &a = of_still.answer(still), &b = of_comes.answer(comes);
  ASSERT_EQ(a.count, 1u);
  ASSERT_EQ(b.count, 1u);
  const contact::Contact& contact = b.contacts[0];
  const double rate_m_s = contact.gradient.dot(spatial::to_vector6(comes.V_WT_W));
  ASSERT_GT(rate_m_s, 0.01);
  const spatial::Wrench more = spatial::wrench_from(-contact.material.damping_Ns_per_m * rate_m_s * contact.gradient);
  EXPECT_GT(contact.material.damping_Ns_per_m, 0.5);
  EXPECT_LT(glm::distance(b.F_To_W.force_N - a.F_To_W.force_N, more.force_N), 1e-9);
  EXPECT_LT(glm::distance(b.F_To_W.torque_Nm - a.F_To_W.torque_Nm, more.torque_Nm), 1e-9);
}

TEST(ContactService, ApartButNearIsAContactWithoutForceAndFarIsNone) {
  const Bench bench;
  ContactService service = bench.service();
  const Answer& near = service.answer(bench.pose(-2e-3));
  ASSERT_EQ(near.count, 1u);
  EXPECT_GE(near.contacts[0].depth_m, overlap_m(-2e-3) - 1e-6);
  EXPECT_LE(near.contacts[0].depth_m, overlap_m(-2e-3) + kSoftening_m);
  EXPECT_EQ(near.F_To_W, spatial::Wrench{});
  EXPECT_EQ(service.answer(bench.pose(-20e-3)).count, 0u);
}

TEST(ContactService, AContactKeepsItsNameWhileItLasts) {
  const Bench bench;
  ContactService service = bench.service();
  const contact::ContactId id = service.answer(bench.pose(0.1e-3, 1)).contacts[0].id;
  for (std::uint32_t i = 2; i < 20; ++i) EXPECT_EQ(service.answer(bench.pose(0.1e-3 + 1e-6 * i, i)).contacts[0].id, id);
}

TEST(ContactService, AKilometreFromTheOriginIsFeltAlike) {
  Bench bench;
  ContactService here = bench.service();
  const contact::Contact a = here.answer(bench.pose(0.2e-3)).contacts[0];
  bench.X_WO.p = {1000, 2000, -500};
  ContactService there = bench.service();
  const contact::Contact b = there.answer(bench.pose(0.2e-3)).contacts[0];
  EXPECT_NEAR(a.depth_m, b.depth_m, 1e-12);  // one unit in the last place of a kilometre is 1e-13 m
  EXPECT_LT((a.gradient - b.gradient).norm(), 1e-6);
}

/// What is felt depends on how the two move against each other, and on nothing else.
TEST(ContactService, AnObjectThatMovesIsFeltAsAToolThatMovesTheOtherWay) {
  const Bench bench;
  const std::vector<motion::Keyframe> keys{{0, {{1, 0, 0, 0}, {0.1, 0, 0}}},
                                           {0.05, {spatial::rotation_from_vector({0.2, 0.1, 1}), {0.11, 0.01, 0.03}}},
                                           {0.1, {{1, 0, 0, 0}, {0.1, 0, 0}}}};
  const motion::ScriptedMotion script(keys, motion::Afterwards::kRepeats);
  const contact::Material material{
      .stiffness_N_per_m = 2000, .damping_Ns_per_m = 2, .static_friction = 0.4, .dynamic_friction = 0.3};
  const TouchableObject still{.felt = &bench.table, .material = material, .X_WO = {}};
  TouchableObject moving = still;
  moving.motion = &script;
  const TouchableObject tool{.felt = &bench.tool, .material = material, .X_WO = {}};
  ContactService of_still({&still, 1}, tool, {}), of_moving({&moving, 1}, tool, {});
  double largest_N = 0;
  for (std::uint32_t i = 0; i < 250; ++i) {
    const double s = 1e-3 * i;
    ToolPose in_O = bench.pose(0.3e-3 * std::sin(40 * s), i);
    in_O.X_WT.p.x += 2e-3 * std::sin(25 * s);  // it sticks, slides and comes off
    in_O.V_WT_W.linear_m_s = {0.05 * std::cos(25 * s), 0, -0.012 * std::cos(40 * s)};
    const motion::Placement O = script.at(s);
    ToolPose in_W = in_O;
    in_W.X_WT = O.X_WO * in_O.X_WT;
    const glm::dvec3 p_OTo_W = spatial::rotate(O.X_WO, in_O.X_WT.p);
    in_W.V_WT_W = {O.V_WO_W.angular_rad_s,
                   spatial::rotate(O.X_WO, in_O.V_WT_W.linear_m_s) + spatial::velocity_at(O.V_WO_W, p_OTo_W)};
    const contact::ContactSet &a = of_still.answer(in_O), &b = of_moving.answer(in_W);
    ASSERT_EQ(a.count, b.count) << i;
    for (std::uint32_t k = 0; k < a.count; ++k) {
      const contact::Contact there = contact::carried(a.contacts[k], O.X_WO);
      EXPECT_EQ(a.contacts[k].id, b.contacts[k].id);
      // Rounding may decide whether a cell far below the peak is looked at; what is apart is summed coarsely.
      const double part = there.depth_m > 0 ? 1 : 5;
      EXPECT_NEAR(there.depth_m, b.contacts[k].depth_m, part * 1e-8);
      EXPECT_LT(glm::distance(there.p_WC_W, b.contacts[k].p_WC_W), part * 2e-6);
      EXPECT_LT((there.gradient - b.contacts[k].gradient).norm(), part * 1e-4);
    }
    EXPECT_LT(glm::distance(spatial::rotate(O.X_WO, a.F_To_W.force_N), b.F_To_W.force_N), 1e-4) << i;
    EXPECT_LT(glm::distance(spatial::rotate(O.X_WO, a.F_To_W.torque_Nm), b.F_To_W.torque_Nm), 1e-6) << i;
    largest_N = std::max(largest_N, glm::length(a.F_To_W.force_N));
  }
  EXPECT_GT(largest_N, 0.3);
}

/// Wherever a course has brought an object, it is felt as one that always stood there.
TEST(ContactService, AnObjectThatCameSomewhereIsFeltAsOneThatStoodThere) {
  Bench bench;
  const spatial::Pose X_there{spatial::rotation_from_vector({0.3, -0.2, 0.5}), {0.2, -0.1, 0.05}};
  const TouchableObject tool{.felt = &bench.tool, .material = {}, .X_WO = {}};
  const TouchableObject may{.felt = &bench.table, .material = {}, .X_WO = {}, .may_change = true, .is_there = false};
  ContactService changed({&may, 1}, tool, {});
  motion::Course course = motion::at_rest(X_there, true);
  course.version = 1, course.from_s = 0.5;
  changed.set_out({0, course});
  bench.X_WO = X_there;
  ContactService still = bench.service();
  double deepest_m = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const ToolPose pose = bench.pose(0.3e-3 * std::sin(0.02 * i), i);
    const contact::ContactSet& of_changed = changed.answer(pose);
    if (i == 499) {
      EXPECT_EQ(of_changed.count, 0u) << "it is not there yet";
    }
    if (i < 500) continue;
    if (i == 500) changed.restart();
    const contact::ContactSet &a = i == 500 ? changed.answer(pose) : of_changed, &b = still.answer(pose);
    ASSERT_EQ(a.count, b.count) << i;
    for (std::uint32_t k = 0; k < a.count; ++k) {
      ASSERT_EQ(a.contacts[k].depth_m, b.contacts[k].depth_m) << i;
      ASSERT_EQ(a.contacts[k].p_WC_W, b.contacts[k].p_WC_W) << i;
      deepest_m = std::max(deepest_m, a.contacts[k].depth_m);
    }
  }
  EXPECT_GT(deepest_m, 0.1e-3);
}

TEST(ContactService, WhatHasGoneIsNotFelt) {
  const Bench bench;
  const TouchableObject tool{.felt = &bench.tool, .material = {}, .X_WO = {}};
  const TouchableObject may{.felt = &bench.table, .material = {}, .X_WO = {}, .may_change = true};
  ContactService service({&may, 1}, tool, {});
  motion::Course gone = motion::at_rest({}, false);
  gone.version = 1, gone.from_s = 0.1;
  service.set_out({0, gone});
  for (std::uint32_t i = 0; i < 200; ++i)
    EXPECT_EQ(service.answer(bench.pose(0.2e-3, i)).count, i < 100 ? 1u : 0u) << i;
}

/// All but one tile, and that one is nowhere near.
class NearlyAllHeights final : public HeightPresence {
 public:
  [[nodiscard]] bool has(const SurfaceTile& where) const noexcept override { return where != missing_; }
  [[nodiscard]] double off_m(const SurfaceTile&) const noexcept override { return 0; }

 private:
  SurfaceTile missing_{1, 0};
};

// Tables in one place under stiff ridges, stroked at 0.1 m/s and 4 kHz. Crests against crests are widened, by what is
// known of the contacts that were searched.
TEST(ContactService, OnABudgetContactsAreAsDeepAndAsWideAsWithAllSearched) {
  Bench bench;
  bench.table = ridged_plate(3e-3, 0.3e-3, {.size_m = {0.04, 0.03, 0.004}, .texel_m = 1e-4});
  const contact::Material stiff{.stiffness_N_per_m = 8000};
  std::vector<TouchableObject> tables;
  for (int k = 0; k < 5; ++k)
    tables.push_back({.felt = &bench.table, .material = stiff, .X_WO = {{1, 0, 0, 0}, {0, 0, 1e-5 * k}}});
  const NearlyAllHeights heights;
  ContactOptions options{.most_stiffness_N_per_m = kHeldStiffness_N_per_m};
  const TouchableObject tool{.felt = &bench.tool, .material = stiff};
  ContactService all(tables, tool, options);
  options.heights = &heights, options.most_searches = 2;
  ContactService some(tables, tool, options);
  double widest_m = 0, square = 0;
  int count = 0;
  for (std::uint32_t i = 0; i < 400; ++i) {
    ToolPose pose = bench.pose(0.4e-3, i);
    pose.time_ns = i * 250'000LL;
    pose.X_WT.p.x += 25e-6 * std::min(i % 200, 200 - i % 200);
    const Answer &there = all.answer(pose), &here = some.answer(pose);
    ASSERT_EQ(here.count, 5u);
    ASSERT_EQ(there.count, 5u);
    EXPECT_LE(here.times.grids, i == 0 ? 5u : 2u);
    EXPECT_GE(here.times.grids, i == 0 ? 5u : 1u) << "one is searched, however costly";
    for (std::uint32_t k = 0; k < 5; ++k) {
      ASSERT_EQ(here.contacts[k].doubts & contact::kFeltByOutline, 0);
      square += std::pow(here.contacts[k].depth_m - there.contacts[k].depth_m, 2), ++count;
    }
    EXPECT_NEAR(here.times.widest_m, there.times.widest_m, 0.3 * there.times.widest_m);
    widest_m = std::max(widest_m, there.times.widest_m);
  }
  EXPECT_GT(widest_m, 15e-6);
  EXPECT_LT(std::sqrt(square / count), 5e-6);
  RecordProperty("depth_rms_um", std::to_string(1e6 * std::sqrt(square / count)));
}

TEST(ContactService, TheLinearisationPredictsTheNextPose) {
  const Bench bench;
  ContactService service = bench.service();
  (void)service.answer(bench.pose(0.2e-3));  // the first answer finds the step that later ones keep
  const contact::Contact now = service.answer(bench.pose(0.2e-3)).contacts[0];
  ToolPose next = bench.pose(0.2e-3);
  const double step_m = 1e-6;
  next.X_WT.p += step_m * glm::dvec3{0.6, 0, -0.8};
  const contact::Contact then = service.answer(next).contacts[0];
  const double predicted = now.depth_m + step_m * (0.6 * now.gradient[3] - 0.8 * now.gradient[5]);
  EXPECT_NEAR(then.depth_m, predicted, 0.02 * step_m);
}

// A feature that a scene lacks does none of its work.
TEST(ContactService, WithoutTextureNoGridRunsAndWithoutFrictionNothingIsRemembered) {
  const Bench bench;
  const geometry::HapticSurface table = support::untextured(support::box_mesh({0.03, 0.03, 0.01})),
                                tool = support::untextured(support::box_mesh({0.01, 0.008, 0.006}));
  const contact::Material smooth{.static_friction = 0, .dynamic_friction = 0};
  const TouchableObject plain{.felt = &table, .material = smooth, .X_WO = {}};
  ContactService service({&plain, 1}, {.felt = &tool, .material = smooth, .X_WO = {}}, {});
  const Answer& set = service.answer({.X_WT = {{1, 0, 0, 0}, {0, 0, 0.0078}}, .V_WT_W = {}});
  ASSERT_EQ(set.count, 1u);
  EXPECT_GT(set.F_To_W.force_N.z, 0.1);
  EXPECT_EQ(set.times.grids, 0u);
  EXPECT_EQ(set.times.closed_forms, 1u);
  EXPECT_EQ(set.times.frictions, 0u);
  for (const auto* surface : {&table, &tool}) {
    EXPECT_EQ(collision::HullTree(collision::ConvexPieces(*surface)).nodes().size(), 1u) << "one piece needs no tree";
  }

  ContactService textured = bench.service();
  const StageTimes& times = textured.answer(bench.pose(0.2e-3)).times;
  EXPECT_EQ(times.grids, 1u);
  EXPECT_EQ(times.closed_forms, 0u);
  EXPECT_EQ(times.frictions, 1u);
}

// The grid finds the same, up to what it makes of sharp edges: they count as rounded over 0.2 mm.
TEST(ContactService, WithoutTextureTheAnswerIsTheGridsUpToItsRoundedEdges) {
  const geometry::HapticSurface table = support::untextured(support::box_mesh({0.03, 0.03, 0.01})),
                                tool = support::untextured(support::box_mesh({0.01, 0.008, 0.006}));
  const TouchableObject plain{.felt = &table, .material = {}, .X_WO = {}};
  const TouchableObject held{.felt = &tool, .material = {}, .X_WO = {}};
  ContactService fast({&plain, 1}, held, {}), slow({&plain, 1}, held, {.maker = penetration::reference_maker()});
  for (std::uint32_t i = 0; i < 12; ++i) {
    const spatial::Pose X_WT{spatial::rotation_from_vector({1e-4 * i, 0, 0}), {1e-3 * i, 0, 0.0078}};
    const ToolPose pose{.sequence = i, .time_ns = i * 1'000'000LL, .X_WT = X_WT, .V_WT_W = {}};
    const Answer& of_slow = slow.answer(pose);
    const contact::Contact a = fast.answer(pose).contacts[0], b = of_slow.contacts[0];
    EXPECT_EQ(of_slow.times.grids, 1u);
    EXPECT_NEAR(a.depth_m, b.depth_m, 25e-6) << i;
    EXPECT_LT((a.gradient - b.gradient).tail<3>().norm(), 0.02) << i;
  }
}

/// A box whose six faces are a piece each: sheets without any thickness.
geometry::HapticSurface box_of_sheets(const glm::dvec3& size_m) {
  geometry::HapticSurface box = support::untextured(support::box_mesh(size_m));
  for (std::size_t t = 0; t < box.coarse.triangles.size(); ++t) {
    const glm::dvec3 n = geometry::unit_normal(box.coarse, box.coarse.triangles[t]);
    const std::uint32_t axis = std::abs(n.x) > 0.5 ? 0 : std::abs(n.y) > 0.5 ? 1 : 2;
    box.triangle_piece[t] = 2 * axis + (n[static_cast<int>(axis)] > 0);
  }
  box.piece_count = 6;
  return box;
}

double deepest_m(const contact::ContactSet& set) {
  double most_m = -1;
  for (std::uint32_t i = 0; i < set.count; ++i) most_m = std::max(most_m, set.contacts[i].depth_m);
  return most_m;
}

TEST(ContactService, SheetsPressedThroughEachOtherAreNotLetGo) {
  const geometry::HapticSurface table = box_of_sheets({0.06, 0.06, 0.03}), tool = box_of_sheets({0.03, 0.02, 0.01});
  const TouchableObject object{.felt = &table, .material = {}, .X_WO = {}};
  for (const double tilt_rad : {0.0, 1e-6, 0.01, 0.05}) {
    ContactService service({&object, 1}, {.felt = &tool, .material = {}, .X_WO = {}}, {});
    const double reach_m = 0.015 * std::sin(tilt_rad) + 0.005 * std::cos(tilt_rad);  // of the tool's lowest corner
    for (std::uint32_t i = 0; i < 80; ++i) {
      const double press_m = 0.05e-3 * i;
      const contact::ContactSet& set =
          service.answer({.sequence = i,
                          .time_ns = i * 1'000'000LL,
                          .X_WT = {spatial::rotation_from_vector({0, tilt_rad, 0}), {0, 0, 0.015 + reach_m - press_m}},
                          .V_WT_W = {}});
      EXPECT_NEAR(deepest_m(set), press_m, 0.15e-3) << tilt_rad << " rad, " << press_m << " m";
      if (press_m > 0.3e-3) {
        EXPECT_GT(set.F_To_W.force_N.z, 0) << tilt_rad << " rad, " << press_m << " m";
      }
    }
  }
}

TEST(ContactService, AThinToolUnderAThinPlateIsNotPulledThrough) {
  const geometry::HapticSurface plate = box_of_sheets({0.06, 0.06, 0.0015}), tool = box_of_sheets({0.03, 0.02, 0.003});
  const TouchableObject object{.felt = &plate, .material = {}, .X_WO = {}};
  for (const double gap_m : {0.1e-3, 0.3e-3, -0.1e-3, -0.3e-3}) {
    ContactService service({&object, 1}, {.felt = &tool, .material = {}, .X_WO = {}}, {});
    const Answer& set = service.answer(
        {.sequence = 1, .time_ns = 0, .X_WT = {{1, 0, 0, 0}, {0, 0, -0.00075 - 0.0015 - gap_m}}, .V_WT_W = {}});
    EXPECT_NEAR(deepest_m(set), -gap_m, 0.1e-3);
    EXPECT_LE(set.F_To_W.force_N.z, 0) << "pushed down, out of the plate's underside";
  }
}

}  // namespace
}  // namespace farfeel::contact_service
