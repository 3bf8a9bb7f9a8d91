#include "haptic_core/local_model/seen_curvature.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Matrix6;
using spatial::Vector6;

Vector6 random_way(std::mt19937& random, double most_m) {
  std::uniform_real_distribution<double> any(-most_m, most_m);
  Vector6 way;
  for (int i = 0; i < 6; ++i) way[i] = any(random) * (i < 3 ? 100 : 1);
  return way;
}

TEST(SeenCurvatureTest, FindsTheCurvatureAlongTheLastWay) {
  std::mt19937 random(1);
  const Vector6 slope = (Vector6() << 0.3, -0.2, 0.1, 40, -10, 5).finished();
  const Matrix6 truth =
      slope * slope.transpose() + Matrix6((Vector6() << .01, .01, .01, 50, 50, 50).finished().asDiagonal());
  SeenCurvature seen;
  int followed = 0;
  for (int i = 0; i < 200; ++i) {
    const Vector6 way = random_way(random, 2e-6), turn = truth * way;
    const Matrix6 before = seen.matrix();
    seen.see(way, turn);
    if (seen.matrix() == before) continue;
    followed += (seen.matrix() * way - turn).norm() < 1e-9 * turn.norm();
  }
  EXPECT_GT(followed, 100);
}

TEST(SeenCurvatureTest, StaysPositiveWhateverItSees) {
  std::mt19937 random(2);
  SeenCurvature seen;
  for (int i = 0; i < 20'000; ++i) {
    const double way_m = std::pow(10.0, -8 + 0.2 * (i % 30));
    Vector6 turn = random_way(random, 1);
    turn.head<3>() *= 1e-4;
    seen.see(random_way(random, way_m), i % 7 == 0 ? Vector6(Vector6::Constant(std::nan(""))) : turn);
    const Matrix6 H = seen.matrix();
    ASSERT_TRUE(H.allFinite());
    const auto eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix6>(H).eigenvalues();
    ASSERT_GE(eigenvalues[0], -1e-12 * eigenvalues[5]);
  }
}

TEST(SeenCurvatureTest, NothingIsToldThatIsHeldWithout) {
  SeenCurvature seen;
  const Vector6 across = Vector6::Unit(3);
  seen.see(1e-5 * across, 0.1 * across);  // 10,000 / m
  EXPECT_TRUE(seen.beyond(2, 20'001).isZero(0));
  EXPECT_NEAR(seen.beyond(2, 5'000)(3, 3), 15'000, 1e-6);
  EXPECT_NEAR(seen.beyond(2, 0)(3, 3), 20'000, 1e-6);
}

/// Ridges that lie in grooves: depth d - z + a sqrt(x^2 + w^2).
TickContacts in_a_groove(const spatial::Pose& X_WT) {
  constexpr double kSlope = 0.45, kRound_m = 10e-6;
  const double x = X_WT.p.x, r = std::hypot(x, kRound_m);
  TickContacts tick;
  tick.set.X_WT = X_WT;
  tick.set.count = 1;
  contact::Contact& contact = tick.set.contacts[0];
  contact.id = 1;
  contact.p_WC_W = X_WT.p;
  contact.nhat_ST_W = {0, 0, 1};
  contact.depth_m = kSlope * r - X_WT.p.z;
  contact.gradient[3] = kSlope * x / r;
  contact.gradient[5] = -1;
  contact.lateral_range_m = 0.25e-3;
  contact.material = {.stiffness_N_per_m = 1000, .damping_Ns_per_m = 0.5, .static_friction = 0, .dynamic_friction = 0};
  tick.source[0] = Source::kTiles;
  tick.from_tiles = 1;
  return tick;
}

TEST(SeenCurvatureTest, ALightToolComesToRestWhereRidgesLieInGrooves) {
  constexpr double kTick_s = 1e-3;
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  settings.tool_mass_kg = 0.001;
  LocalModel model(settings);
  tool::RigidTool body{tool::with_mass({}, settings.tool_mass_kg), {{1, 0, 0, 0}, {5e-5, 0, -2e-3}}, {}};
  double farthest_m = 0;
  for (int i = 0; i < 1000; ++i) {
    model.advance(kTick_s, body.X_WT);
    const TickContacts tick = in_a_groove(body.X_WT);
    model.hear(tick.set);
    model.refresh(tick, body.X_WT);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    forces.F_To_W[5] -= 2;
    forces.by_twist.bottomRightCorner<3, 3>().diagonal().array() -= 1;  // a coupling's damper
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    model.settle(tool::applied_wrench(felt.response, stepped, kTick_s), stepped.V_moved, kTick_s, body.X_WT);
    if (i >= 500) farthest_m = std::max(farthest_m, std::abs(body.X_WT.p.x));
  }
  EXPECT_LT(farthest_m, 2e-6);  // 0.3 mm without
  EXPECT_GE(model.contact_port().least_J(), -1e-6);
}

}  // namespace
}  // namespace farfeel::local_model
