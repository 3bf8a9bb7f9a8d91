// Felt contacts as rows: the forces of penalty where each row has a spring of its own, one pad where they share it.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::local_model {
namespace {

using constraint::TouchingTool;
using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

constexpr double kTick_s = 1e-3, kStiffness_N_per_m = 1000;

struct Plane {
  glm::dvec3 point_T, nhat_W;
  glm::dvec3 outward_W{0};  ///< the plane's own normal, where the direction leans from it
};

/// Points of a tool on planes through the origin.
contact::ContactSet touching(const std::vector<Plane>& planes, const Pose& X_WT, std::int64_t time_ns = 0) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  set.pose_time_ns = time_ns;
  for (const Plane& plane : planes) {
    contact::Contact& contact = set.contacts[set.count];
    contact.id = set.count++;
    contact.nhat_ST_W = glm::normalize(plane.nhat_W);
    contact.p_WC_W = spatial::transform_point(X_WT, plane.point_T);
    const glm::dvec3& outward_W = plane.outward_W == glm::dvec3(0) ? contact.nhat_ST_W : plane.outward_W;
    const glm::dvec3 by_translation = -outward_W / glm::dot(outward_W, contact.nhat_ST_W);
    contact.depth_m = glm::dot(by_translation, contact.p_WC_W);
    contact.gradient = spatial::to_vector6(Twist{glm::cross(contact.p_WC_W - X_WT.p, by_translation), by_translation});
    contact.lateral_range_m = 1;
    contact.material = {
        .stiffness_N_per_m = kStiffness_N_per_m, .damping_Ns_per_m = 0.2, .static_friction = 0, .dynamic_friction = 0};
  }
  return set;
}

LocalModelSettings constraint_settings() {
  LocalModelSettings settings;
  settings.contact = ContactLaw::kConstraint;
  settings.tool_mass_kg = 0.05;
  return settings;
}

tool::RigidTool body(const Pose& X_WT, const Twist& V_WT_W = {}) {
  return {tool::with_mass({}, 0.05), X_WT, V_WT_W};
}

/// A tool on a coupling in the hand, fresh contacts in every tick, looked up where the model says.
struct Held {
  explicit Held(std::vector<Plane> on) : planes(std::move(on)), model(constraint_settings()) {}
  void tick(const Pose& X_WD) {
    model.advance(kTick_s, touching_tool.tool.X_WT);
    if (is_told) model.update(touching(planes, model.where_to_look(touching_tool, kTick_s)), touching_tool.tool.X_WT);
    const tool::VirtualCoupling coupling(gains, {});
    const auto pull = coupling.evaluate(X_WD, {}, touching_tool.tool.X_WT, touching_tool.tool.V_WT_W).on_tool;
    const constraint::Law law = constraint::one_pad(gains.stiffness_N_per_m);
    const auto rows = model.rows(touching_tool, kTick_s);
    const Pose X_WQ = touching_tool.X_WP;
    report = constraint::take_tick(touching_tool, pull, rows, X_WQ, kTick_s, law, model.tank().available_J());
    felt = model.settle(touching_tool, report, kTick_s, pushes);
    hand_N = coupling.evaluate(X_WD, {}, touching_tool.tool.X_WT, touching_tool.tool.V_WT_W).F_hand_W.force_N;
  }
  /// Pressed slowly, so that nothing is left of the way in.
  void press(const glm::dvec3& way_m) {
    for (int i = 1; i <= 1500; ++i) tick({{1, 0, 0, 0}, std::min(1.0, i / 500.0) * way_m});
  }

  tool::CouplingGains gains{2000, 1, 5, 0.005};
  std::vector<Plane> planes;
  bool is_told = true;
  LocalModel model;
  TouchingTool touching_tool = constraint::untouched(body({}));
  constraint::TickReport report;
  Felt felt;
  Pushes pushes;
  glm::dvec3 hand_N{0};
};

TEST(ModelRows, OfSpringsTheyStepLikePenaltyToTheLastDigits) {
  const std::vector<Plane> planes{{{0.02, 0.01, 0}, {0.1, 0, 1}}, {{-0.02, 0.003, 0}, {0, -0.2, 1}}};
  const Pose X_WT{glm::normalize(glm::dquat(1, 0.01, -0.02, 0.005)), {0.001, 0.002, -0.004}};
  const Twist V_WT_W{{0.05, -0.1, 0.02}, {0.01, 0.005, -0.02}};
  LocalModelSettings settings = constraint_settings();
  settings.tank = {.cap_J = 1, .allowance_W = 10};  // what is pressed is let in, whatever it costs
  LocalModel by_rows(settings);
  settings.contact = ContactLaw::kPenalty;
  LocalModel by_springs(settings);
  for (LocalModel* model : {&by_springs, &by_rows}) {
    for (int i = 0; i < 600; ++i) {  // all that is owed is let in
      model->advance(kTick_s, X_WT);
      model->update(touching(planes, X_WT), X_WT);
    }
  }
  const tool::VirtualCoupling coupling({2000, 1, 5, 0.005}, {});
  tool::RigidTool sprung = body(X_WT, V_WT_W);
  TouchingTool rowed = constraint::untouched(body(X_WT, V_WT_W));
  const tool::LinearResponse pull = coupling.evaluate({}, {}, X_WT, V_WT_W).on_tool;
  tool::LinearResponse forces = pull;
  forces += by_springs.evaluate(X_WT, V_WT_W, kTick_s).response;
  (void)tool::step(sprung, forces, kTick_s);
  const auto rows = by_rows.rows(rowed, kTick_s);
  ASSERT_EQ(rows.size(), planes.size());
  constraint::take_tick(rowed, pull, rows, X_WT, kTick_s, constraint::springs());
  for (std::size_t i = 0; i < planes.size(); ++i) EXPECT_GT(rowed.memory.forces[i].normal_N, 0.5);
  const Vector6 off = spatial::to_vector6(sprung.V_WT_W) - spatial::to_vector6(rowed.tool.V_WT_W);
  EXPECT_LT(off.norm(), 1e-10);
}

TEST(ModelRows, TheProxyStaysOnTheSurfaceAndTheHandFeelsPadAndCouplingInSeries) {
  Held held({{{0, 0, 0}, {0, 0, 1}}});
  held.press({0, 0, -3e-3});
  const double expected_N = 3e-3 * 2000 * kStiffness_N_per_m / (2000 + kStiffness_N_per_m);
  EXPECT_NEAR(held.hand_N.z, expected_N, 0.01 * expected_N);
  EXPECT_NEAR(held.touching_tool.tool.X_WT.p.z, -expected_N / kStiffness_N_per_m, 20e-6);
  EXPECT_NEAR(held.touching_tool.X_WP.p.z, 0, 1e-6);
  EXPECT_EQ(held.felt.pressing, 1u);
  ASSERT_EQ(held.pushes.count, 1u);
  EXPECT_NEAR(held.pushes.of[0].force_N.z, expected_N, 0.01 * expected_N);
}

TEST(ModelRows, EightThatReportOnePlacePressAndStoreLikeOne) {
  Held one({{{0, 0, 0}, {0, 0, 1}}}), eight(std::vector<Plane>(8, {{0, 0, 0}, {0, 0, 1}}));
  one.press({0, 0, -3e-3}), eight.press({0, 0, -3e-3});
  EXPECT_NEAR(eight.hand_N.z, one.hand_N.z, 0.01 * one.hand_N.z);
  EXPECT_NEAR(eight.felt.energy_J, one.felt.energy_J, 0.02 * one.felt.energy_J);
}

TEST(ModelRows, WhatThePadStoresIsWhatTheToolPutIn) {
  Held held({{{0, 0, 0}, {0.3, 0, 1}}, {{0, 0, 0}, {-0.3, 0, 1}}});
  held.press({0, 0, -3e-3});
  const double in_J = held.model.contact_port().energy_J();
  EXPECT_GT(in_J, 1e-3);
  EXPECT_LE(held.felt.energy_J, in_J + held.model.tank().allowed_J());
  for (int i = 0; i < 500; ++i) held.tick({{1, 0, 0, 0}, {0, 0, -3e-3 * (1 - i / 400.0)}});
  EXPECT_EQ(held.felt.pressing, 0u);
  EXPECT_GE(held.model.contact_port().energy_J(), -1e-6);
}

// A slot whose walls are told 0.1 mm thicker than it is wide: nobody pressed, so they push with nothing, and the floor
// below is felt as ever. As springs of 1 N/mm they would push with 0.05 N each, as rows of 3 um/N with 17 N.
TEST(ModelRows, WallsThatLeaveNoRoomAreRecessAndTheFloorBetweenThemIsFelt) {
  Held held({{{50e-6, 0, 0}, {-1, 0, 0}}, {{-50e-6, 0, 0}, {1, 0.02, 0}}, {{0, 0, 0}, {0, 0, 1}}});
  double most_N = 0;
  for (int i = 1; i <= 1500; ++i) {
    held.tick({{1, 0, 0, 0}, {0, 0, -3e-3 * std::min(1.0, i / 500.0)}});
    if (i == 1) continue;  // where it begins inside, each contact has its free step
    for (const std::size_t wall : {0, 1}) most_N = std::max(most_N, held.touching_tool.memory.forces[wall].normal_N);
  }
  EXPECT_LT(most_N, 0.5);
  const double expected_N = 3e-3 * 2000 * kStiffness_N_per_m / (2000 + kStiffness_N_per_m);
  EXPECT_NEAR(held.hand_N.z, expected_N, 0.03 * expected_N);  // the floor's push is shared a little with the walls'
  EXPECT_NEAR(held.hand_N.x, 0, 0.01);
  EXPECT_LT(glm::length(held.touching_tool.X_WP.p), 0.1e-3);
  EXPECT_GE(held.model.tank().level_J(), -1e-6);
}

// The direction in which a slope is told turns while the tool is held: the pad leans the other way over the next
// ticks, and the proxy goes along the slope. What that makes of depth comes as the tank affords it.
TEST(ModelRows, APadThatLeansAcrossASlopeOwesNothing) {
  Held held({{{0, 0, 0}, {0, 0, 1}, {0.4, 0, 0.92}}});
  held.press({0, 0, -3e-3});
  double least_J = 1;
  for (int i = 0; i < 400; ++i) {
    const double angle_rad = 0.3 * std::sin(0.05 * i);
    held.planes[0].nhat_W = {std::sin(angle_rad), 0, std::cos(angle_rad)};
    held.is_told = i % 20 == 0;
    held.tick({{1, 0, 0, 0}, {0, 0, -3e-3}});
    least_J = std::min(least_J, held.model.tank().level_J());
  }
  EXPECT_GT(held.hand_N.z, 1);
  EXPECT_GE(least_J, -1e-8);
}

TEST(ModelRows, AHeldWrenchHasNone) {
  LocalModelSettings settings = constraint_settings();
  settings.rung = Rung::kHeldWrench;
  EXPECT_FALSE(LocalModel(settings).has_rows());
}

}  // namespace
}  // namespace farfeel::local_model
