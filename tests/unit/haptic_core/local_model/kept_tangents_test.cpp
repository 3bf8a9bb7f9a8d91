// A tool whose line of 28 mm lies on a plane: it pushes at one end or at the other, and the remote tells of the deeper.
#include "haptic_core/local_model/kept_tangents.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

constexpr double kTick_s = 1e-3, kHalfLine_m = 0.014, kArm_m = 0.02;

contact::Contact on_plane(const Pose& X_WT, double level_m = 0) {
  contact::Contact contact;
  contact.depth_m = -1;
  for (const double side : {-1.0, 1.0}) {
    const glm::dvec3 end = spatial::transform_point(X_WT, {0, side * kHalfLine_m, -kArm_m});
    if (level_m - end.z <= contact.depth_m) continue;
    contact.p_WC_W = end;
    contact.depth_m = level_m - end.z;
  }
  contact.nhat_ST_W = {0, 0, 1};
  contact.gradient = spatial::to_vector6(Twist{glm::cross(contact.p_WC_W - X_WT.p, glm::dvec3(0, 0, -1)), {0, 0, -1}});
  contact.lateral_range_m = 0.25e-3;
  contact.material.stiffness_N_per_m = 1250;
  contact.material.static_friction = contact.material.dynamic_friction = 0;
  return contact;
}

class KeptTangentsTest : public ::testing::Test {
 protected:
  /// The line about a millimetre deep.
  Pose pose(double tilt_rad) {
    return {spatial::rotation_from_vector({tilt_rad * uniform_(random_), 0, 0}),
            {2e-5 * uniform_(random_), 2e-5 * uniform_(random_), kArm_m - 1e-3 + 2e-4 * uniform_(random_)}};
  }
  FeltContact next(const FeltContact& older, const Pose& X0, double level_m = 0) {
    FeltContact felt = felt_contact(on_plane(X0, level_m), X0);
    felt.keep(older);
    return felt;
  }
  /// After both ends were told of.
  FeltContact rocked(double tilt_rad) {
    FeltContact felt = felt_contact(on_plane(pose(0)), pose(0));
    for (int i = 0; i < 20; ++i) felt = next(felt, pose(tilt_rad));
    return felt;
  }

  std::mt19937 random_{5};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(KeptTangentsTest, AtThePoseThatTheNewestIsForNothingIsSaidButThat) {
  FeltContact felt = felt_contact(on_plane(pose(0)), pose(0));
  for (int i = 0; i < 200; ++i) {
    const Pose X0 = pose(0.02);
    const double level_m = i % 50 < 25 ? 0 : -0.5e-3;  // the plane sinks, and what was kept of it does
    felt = next(felt, X0, level_m);
    EXPECT_NEAR(felt.sample(X0).depth_m, on_plane(X0, level_m).depth_m, 1e-12);
  }
}

TEST_F(KeptTangentsTest, BothEndsAreFeltWhereOnlyOneWasToldLast) {
  const FeltContact felt = rocked(0.005);
  for (int i = 0; i < 100; ++i) {
    const Pose X = pose(0.005);
    const double truth_m = on_plane(X).depth_m;
    EXPECT_NEAR(felt.sample(X).depth_m, truth_m, 100e-6);
    EXPECT_LT(felt.sample(X).depth_m, truth_m + 50e-6);
  }
}

TEST_F(KeptTangentsTest, GradientAndBendAreTheDepthsDerivatives) {
  FeltContact felt = rocked(0.005);
  felt.transition.offset_W = {1e-3, -2e-3, 0};
  for (int i = 0; i < 100; ++i) {
    const Pose X = pose(0.001);
    const auto here = felt.sample(X);
    const spatial::Matrix6 bend = felt.bend_at(X);
    for (int axis = 0; axis < 6; ++axis) {
      const auto at = [&](double step) {
        const Vector6 d = step * Vector6::Unit(axis);
        return felt.sample(spatial::integrate(X, spatial::twist_from(d), 1));
      };
      constexpr double kStep = 1e-7;
      EXPECT_NEAR((at(kStep).depth_m - at(-kStep).depth_m) / (2 * kStep), here.gradient[axis], 1e-5);
      const Vector6 turned = (at(kStep).gradient - at(-kStep).gradient) / (2 * kStep);
      // Without what each tangent's own gradient turns by, which is an arm's length.
      EXPECT_LT((turned - bend.col(axis)).norm(), 0.1 + 2e-3 * bend.norm());
    }
  }
}

TEST_F(KeptTangentsTest, WhatTheToolHasMovedAwayFromAlongTheSurfaceIsForgotten) {
  FeltContact felt = rocked(0.005);
  for (int i = 0; i < 60; ++i) {
    Pose X0 = pose(0);
    X0.p.x += 0.2e-3 * i;
    X0.R = spatial::rotation_from_vector({0.01, 0, 0});  // stays on one end
    felt = next(felt, X0);
  }
  Pose X = felt.received.X0_WT;
  X.R = spatial::rotation_from_vector({-0.01, 0, 0});
  const Tangent one_end = felt.received.tangent();
  EXPECT_NEAR(felt.sample(X).depth_m, one_end.at(X).depth_m, 1e-6);
}

/// To, a point, against a face across x whose two flanks rise by kSteep along z from their common line: as a groove's,
/// or as a crest's.
constexpr double kSteep = 0.7;
enum class Flanks { kGroove, kCrest };

contact::Contact on_flanks(Flanks flanks, const glm::dvec3& p_W) {
  const double along = (p_W.z > 0) == (flanks == Flanks::kGroove) ? kSteep : -kSteep;
  contact::Contact contact;
  contact.p_WC_W = p_W;
  contact.nhat_ST_W = {1, 0, 0};
  contact.depth_m = along * p_W.z - p_W.x;
  contact.gradient = spatial::to_vector6(Twist{{}, {-1, 0, along}});
  contact.lateral_range_m = 1e-3;
  contact.material.stiffness_N_per_m = 1250;
  return contact;
}

/// Told where the point was above the line, and then below; each answer so old as news_s says.
FeltContact told_of_both(Flanks flanks, double news_s) {
  FeltContact felt;
  for (const double z_m : {0.1e-3, -0.1e-3}) {
    const Pose X0{{1, 0, 0, 0}, {-0.2e-3, 0, z_m}};
    FeltContact newer = felt_contact(on_flanks(flanks, X0.p), X0);
    newer.received.origin.news_s = news_s;
    if (z_m < 0) newer.keep(felt);
    felt = newer;
  }
  return felt;
}

TEST(KeptFlanksTest, OfAGrooveBothAreFeltWhereOneWasToldLateAsFarAsTheyAreMeantToHold) {
  const FeltContact felt = told_of_both(Flanks::kGroove, kSlowestNews_s);
  for (double z_m = -0.8e-3; z_m < 0.8e-3; z_m += 0.05e-3) {
    const glm::dvec3 p_W{-0.2e-3, 0, z_m};
    EXPECT_NEAR(felt.sample({{1, 0, 0, 0}, p_W}).depth_m, on_flanks(Flanks::kGroove, p_W).depth_m, 50e-6) << z_m;
  }
}

TEST(KeptFlanksTest, OfAGrooveThatIsToldOfSoonTheNewestAloneIsFelt) {
  const FeltContact felt = told_of_both(Flanks::kGroove, 0);
  for (const double z_m : {-0.2e-3, 0.0, 0.2e-3}) {
    const Pose X{{1, 0, 0, 0}, {-0.2e-3, 0, z_m}};
    EXPECT_NEAR(felt.sample(X).depth_m, felt.received.tangent().at(X).depth_m, 1e-12) << z_m;
  }
}

TEST(KeptFlanksTest, OverACrestTheNewestAloneIsFelt) {
  const FeltContact felt = told_of_both(Flanks::kCrest, kSlowestNews_s);
  for (const double z_m : {-0.2e-3, 0.0, 0.2e-3}) {
    const Pose X{{1, 0, 0, 0}, {-0.2e-3, 0, z_m}};
    EXPECT_NEAR(felt.sample(X).depth_m, felt.received.tangent().at(X).depth_m, 1e-12) << z_m;
  }
}

/// A tool of 100 g that a soft hand presses on the plane while it is told of the line's ends a twentieth of a second
/// late. Returns how far it rocks in the end.
double rocks_rad(double late_s) {
  constexpr double kHand_N_per_m = 250, kHand_Nms = 0.006, kHand_Nm_per_rad = 0.5, kHand_Ns_per_m = 4, kPush_m = 0.012;
  LocalModelSettings settings;
  settings.tool_mass_kg = 0.1;
  LocalModel model(settings);
  tool::RigidTool body{{0.1, Eigen::Vector3d(2e-4, 2e-4, 2e-4).asDiagonal()}, {}, {}};
  body.X_WT = {spatial::rotation_from_vector({0.01, 0, 0}), {0, 0, kArm_m + 0.2e-3}};
  std::deque<Pose> line;
  double most_rad = 0;
  for (int i = 0; i < 3000; ++i) {
    model.advance(kTick_s, body.X_WT);
    line.push_back(body.X_WT);
    if (static_cast<double>(line.size()) * kTick_s > late_s) {
      contact::ContactSet set;
      set.X_WT = line.front();
      set.count = 1;
      set.contacts[0] = on_plane(set.X_WT);
      model.update(set, body.X_WT);
      line.pop_front();
    }
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    const double down = std::clamp(i * kTick_s / 0.4, 0.0, 1.0);
    tool::LinearResponse forces = felt.response;
    const glm::dvec3 tilt = spatial::vector_from_rotation(body.X_WT.R);
    const glm::dvec3 aside = body.X_WT.p - glm::dvec3(0, 0, kArm_m - down * kPush_m);
    forces.F_To_W +=
        spatial::to_vector6(spatial::Wrench{-kHand_Nm_per_rad * tilt - kHand_Nms * body.V_WT_W.angular_rad_s,
                                            -kHand_N_per_m * aside - kHand_Ns_per_m * body.V_WT_W.linear_m_s});
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    model.settle(tool::applied_wrench(felt.response, stepped, kTick_s), stepped.V_moved, kTick_s, body.X_WT);
    if (i >= 2500) most_rad = std::max(most_rad, glm::length(spatial::vector_from_rotation(body.X_WT.R)));
  }
  return most_rad;
}

TEST(LocalModelOfALine, DoesNotRockFromEndToEndHoweverLateItIsToldOfThem) {
  for (const double late_s : {0.0, 0.05, 0.2}) EXPECT_LT(rocks_rad(late_s), 1e-3) << late_s;
}

}  // namespace
}  // namespace farfeel::local_model
