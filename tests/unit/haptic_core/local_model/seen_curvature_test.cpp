#include "haptic_core/local_model/seen_curvature.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

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

TEST(SeenCurvatureTest, KnowsOneWayWhateverItLearnsOfOthers) {
  SeenCurvature seen;
  const auto look = [&](int along, double way, double curvature) {
    seen.see(way * Vector6::Unit(along), way * curvature * Vector6::Unit(along));
  };
  look(3, 1e-6, 5'000);
  for (int i = 1; i <= 8; ++i) {
    look(4, 1e-6, 10 * i);
    look(5, 1e-6, 10 * i);
  }
  EXPECT_NEAR(seen.matrix()(3, 3), 5'000, 500);
  EXPECT_NEAR(seen.matrix()(4, 4), 80, 8);
}

TEST(SeenCurvatureTest, TurnsWithTheObjectItWasSeenOn) {
  contact::Contact contact;
  contact.nhat_ST_W = {0, 0, 1};
  contact.gradient[5] = -1;
  FeltContact felt = felt_contact(contact, {});
  felt.seen.see(1e-5 * Vector6::Unit(3), 0.1 * Vector6::Unit(3));
  felt.seen.see(1e-3 * Vector6::Unit(1), 1e-4 * Vector6::Unit(1));
  const Matrix6 before = felt.seen.matrix();
  const spatial::Pose way_W{spatial::rotation_from_vector({0, 0, std::numbers::pi / 2}), {0.3, 0.1, 0}};
  felt.go_along(way_W);
  EXPECT_NEAR(felt.seen.matrix()(4, 4), before(3, 3), 1e-9 * before(3, 3));
  EXPECT_NEAR(felt.seen.matrix()(3, 3), 0, 1e-9 * before(3, 3));
  EXPECT_NEAR(felt.seen.matrix()(0, 0), before(1, 1), 1e-9 * before(1, 1));
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

/// Ridges that lie in grooves along y: depth d - z + a sqrt((x - groove)^2 + w^2).
TickContacts in_a_groove(const spatial::Pose& X_WT, double groove_m = 0) {
  constexpr double kSlope = 0.45, kRound_m = 10e-6;
  const double x = X_WT.p.x - groove_m, r = std::hypot(x, kRound_m);
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

/// How far from the groove's middle a light tool is that is pressed into it, at most, after half a second.
/// speed_m_s: of the groove, across; rename: changes a tick's contact before it is taken over.
struct Rest {
  double farthest_m = 0, least_J = 0;
};
Rest pressed_into_a_groove(double speed_m_s, const std::function<void(contact::Contact&, int)>& rename = {}) {
  constexpr double kTick_s = 1e-3, kEnd_s = 1;
  LocalModelSettings settings;
  settings.rung = Rung::kTiles;
  settings.tool_mass_kg = 0.001;
  LocalModel model(settings);
  const std::vector<motion::Keyframe> keys{{0, {}},
                                           {kEnd_s, {{1, 0, 0, 0}, {speed_m_s * kEnd_s, 0, 0}}},
                                           {2 * kEnd_s, {{1, 0, 0, 0}, {2 * speed_m_s * kEnd_s, 0, 0}}}};
  const motion::ScriptedMotion script(keys, motion::Afterwards::kStays);
  motion::MovingObjects objects(speed_m_s == 0 ? std::vector<motion::MovingObject>{}
                                               : std::vector<motion::MovingObject>{{0, script}});
  tool::RigidTool body{tool::with_mass({}, settings.tool_mass_kg), {{1, 0, 0, 0}, {5e-5, 0, -2e-3}}, {}};
  Rest rest;
  for (int i = 0; i < std::lround(kEnd_s / kTick_s); ++i) {
    const auto groove_m = [&](int tick) { return speed_m_s == 0 ? 0 : script.at(kTick_s * tick).X_WO.p.x; };
    objects.go_to(kTick_s * i);
    model.go_along(objects, body.X_WT);
    model.advance(kTick_s, body.X_WT);
    TickContacts tick = in_a_groove(body.X_WT, groove_m(i));
    tick.set.pose_time_ns = std::llround(1e9 * kTick_s * i);
    if (rename) rename(tick.set.contacts[0], i);
    model.hear(tick.set);
    model.refresh(tick, body.X_WT);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    forces.F_To_W[5] -= 2;
    forces.by_twist.bottomRightCorner<3, 3>().diagonal().array() -= 1;                         // a coupling's damper
    forces.F_To_W.head<3>() -= spatial::to_eigen(spatial::vector_from_rotation(body.X_WT.R));  // and its turning spring
    forces.by_pose.topLeftCorner<3, 3>().diagonal().array() -= 1;
    forces.by_twist.topLeftCorner<3, 3>().diagonal().array() -= 0.01;
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    model.settle(tool::applied_wrench(felt.response, stepped, kTick_s), stepped.V_moved, kTick_s, body.X_WT);
    if (i >= 500) rest.farthest_m = std::max(rest.farthest_m, std::abs(body.X_WT.p.x - groove_m(i + 1)));
    rest.least_J = std::min(rest.least_J, model.contact_port().energy_J() + model.script_work_J());
  }
  return rest;
}

TEST(SeenCurvatureTest, ALightToolComesToRestWhereRidgesLieInGrooves) {
  const Rest rest = pressed_into_a_groove(0);
  EXPECT_LT(rest.farthest_m, 2e-6);  // 0.3 mm without
  EXPECT_GE(rest.least_J, -1e-6);
}

TEST(SeenCurvatureTest, ALightToolIsCarriedAlongByAGrooveThatMoves) {
  const Rest rest = pressed_into_a_groove(0.02);
  EXPECT_LT(rest.farthest_m, 1e-6);  // 15 um where curvature holds it back
  EXPECT_GE(rest.least_J, -1e-6);
}

// The point of a contact along a line may be any of the line's, and a cluster whose point jumps has another name.
TEST(SeenCurvatureTest, ALightToolStaysAtRestWhereContactsAreRenamed) {
  const Rest rest = pressed_into_a_groove(0, [](contact::Contact& contact, int tick) {
    contact.id = static_cast<std::uint32_t>(tick / 5);
    contact.p_WC_W.y = 0.01 * (contact.id.number % 2);
  });
  EXPECT_LT(rest.farthest_m, 50e-6);
}

// A linearised slope that ends 0.25 mm further, where a hand pulls the tool against it: neither side holds it.
TEST(SeenCurvatureTest, ALightToolComesToRestWhereALinearisationEnds) {
  constexpr double kTick_s = 1e-3;
  LocalModelSettings settings;
  settings.tool_mass_kg = 0.001;
  LocalModel model(settings);
  TickContacts slope = in_a_groove({{1, 0, 0, 0}, {-1e-3, 0, 0}});
  slope.set.contacts[0].depth_m = 0;
  model.update(slope.set, {{1, 0, 0, 0}, {0, 0, 1e-3}});
  tool::RigidTool body{tool::with_mass({}, settings.tool_mass_kg), {{1, 0, 0, 0}, {-1e-3, 0, 0}}, {}};
  double farthest_m = 0, least_J = 0;
  for (int i = 0; i < 1000; ++i) {
    model.advance(kTick_s, body.X_WT);
    model.hear(slope.set);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    const glm::dvec3 held{-1e-3, 0, -2e-3};  // by a coupling, deep in the slope
    forces.F_To_W.tail<3>() += 2000 * spatial::to_eigen(held - body.X_WT.p);
    forces.by_pose.diagonal().tail<3>().array() -= 2000;
    const tool::StepWork stepped = tool::step(body, forces, kTick_s);
    model.settle(tool::applied_wrench(felt.response, stepped, kTick_s), stepped.V_moved, kTick_s, body.X_WT);
    if (i >= 500) farthest_m = std::max(farthest_m, kTick_s * glm::length(body.V_WT_W.linear_m_s));
    least_J = std::min(least_J, model.contact_port().energy_J() + model.tank().allowed_J());
  }
  EXPECT_LT(farthest_m, 1e-7);
  EXPECT_GE(least_J, -1e-6);
}

}  // namespace
}  // namespace farfeel::local_model
