// Objects that move by a script, as the local model feels them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

constexpr double kTick_s = 1e-3;
constexpr std::uint32_t kObject = 2;

/// Two point contacts with the plane z = 0 of the object, as the remote would tell of them.
contact::ContactSet on_plane(const Pose& X_WO, const Pose& X_WT, double scene_s) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  set.pose_time_ns = std::llround(1e9 * scene_s);
  const glm::dvec3 n = spatial::rotate(X_WO, {0, 0, 1});
  for (const glm::dvec3& point : {glm::dvec3(0.02, 0, 0), glm::dvec3(-0.02, 0, 0)}) {
    contact::Contact& contact = set.contacts[set.count];
    contact.id = set.count++;
    contact.object = kObject;
    contact.p_WC_W = spatial::transform_point(X_WT, point);
    contact.nhat_ST_W = n;
    contact.depth_m = -glm::dot(n, contact.p_WC_W - X_WO.p);
    contact.gradient = spatial::to_vector6(Twist{-glm::cross(contact.p_WC_W - X_WT.p, n), -n});
    contact.lateral_range_m = 1;
    contact.material = {
        .stiffness_N_per_m = 2000, .damping_Ns_per_m = 3, .static_friction = 0.8, .dynamic_friction = 0.6};
  }
  return set;
}

motion::ScriptedMotion swing() {
  const std::vector<motion::Keyframe> keys{{0, {{1, 0, 0, 0}, {0.1, 0, 0}}},
                                           {0.1, {spatial::rotation_from_vector({0.1, 0.3, 1}), {0.1, 0.03, 0.02}}},
                                           {0.2, {{1, 0, 0, 0}, {0.1, 0, 0}}}};
  return {keys, motion::Afterwards::kRepeats};
}

struct Puppet {
  LocalModel model{LocalModelSettings{}};
  motion::MovingObjects objects;
  Pose X_WT;
  /// One tick of the loop's order, at scene time scene_s; returns the force on the tool.
  Vector6 tick(double scene_s, const contact::ContactSet* news, const Pose& X_next, const Twist& V) {
    objects.go_to(scene_s);
    model.go_along(objects, X_WT);
    model.advance(kTick_s, X_WT);
    if (news) model.update(*news, X_WT);
    const tool::LinearResponse response = model.evaluate(X_WT, V, kTick_s).response;
    const Vector6 twist = spatial::to_vector6(V);
    X_WT = X_next;
    const Vector6 applied = response.F_To_W + kTick_s * ((response.by_pose + response.mean_by_way) * twist);
    model.settle(applied, twist, kTick_s, X_WT);
    return applied;
  }
};

TEST(LocalModelOfMovingObjects, FeelsWhatAToolFeelsThatMovesTheOtherWay) {
  const motion::ScriptedMotion script = swing();
  Puppet still, moving;
  moving.objects = motion::MovingObjects({{kObject, script}});
  const auto in_O = [](double s) {
    return Pose{spatial::rotation_from_vector({0.01 * std::sin(30 * s), 0, 0}),
                {0.1e-3 * std::sin(20 * s), 0, -0.4e-3 + 0.6e-3 * std::cos(35 * s)}};
  };
  const auto twist = [](const Pose& from, const Pose& to) {
    return Twist{spatial::vector_from_rotation(to.R * glm::conjugate(from.R)) / kTick_s, (to.p - from.p) / kTick_s};
  };
  still.X_WT = in_O(0);
  moving.X_WT = script.at(0).X_WO * in_O(0);
  double largest_N = 0, off_N = 0;
  for (int i = 0; i < 400; ++i) {
    const double s = kTick_s * i;
    const Pose next_X_WO = script.at(s + kTick_s).X_WO;
    contact::ContactSet a, b;
    const bool has_news = i % 20 == 0;  // of 15 ms ago
    const double then_s = std::max(s - 0.015, 0.0);
    if (has_news) a = on_plane({}, in_O(then_s), then_s);
    if (has_news) b = on_plane(script.at(then_s).X_WO, script.at(then_s).X_WO * in_O(then_s), then_s);
    const Pose next_O = in_O(s + kTick_s), next_W = next_X_WO * next_O;
    const Vector6 f = still.tick(s, has_news ? &a : nullptr, next_O, twist(still.X_WT, next_O));
    const Vector6 g = moving.tick(s, has_news ? &b : nullptr, next_W, twist(moving.X_WT, next_W));
    const glm::dvec3 force_N = spatial::rotate(next_X_WO, spatial::wrench_from(f).force_N);
    off_N = std::max(off_N, glm::distance(force_N, spatial::wrench_from(g).force_N));
    largest_N = std::max(largest_N, glm::length(force_N));
  }
  EXPECT_GT(largest_N, 2);
  EXPECT_LT(off_N, 0.05 * largest_N) << "a tick sees one velocity, of a swing that changes it by 20 mm/s in a tick";
}

/// A tool on a spring to a hand at rest, lifted, dragged and let down by the object: what the hand may get is what the
/// script put in, and the tank's allowance.
TEST(LocalModelOfMovingObjects, GiveOutNoMoreThanTheirScriptPutsIn) {
  const std::vector<motion::Keyframe> keys{{0, {}},
                                           {0.2, {{1, 0, 0, 0}, {0.01, 0, 0.003}}},
                                           {0.4, {spatial::rotation_from_vector({0, 0, 0.3}), {0.02, 0, -0.003}}},
                                           {0.6, {}}};
  const motion::ScriptedMotion script(keys, motion::Afterwards::kRepeats);
  LocalModelSettings settings;
  settings.tank.allowance_W = 0;
  LocalModel model(settings);
  motion::MovingObjects objects({{kObject, script}});
  tool::RigidTool body{{0.02, Eigen::Matrix3d::Identity() * 1e-5}, {{1, 0, 0, 0}, {0, 0, -0.3e-3}}, {}};
  double least_J = 0, most_script_J = 0, largest_N = 0;
  for (int i = 0; i < 3000; ++i) {
    const double s = kTick_s * i;
    objects.go_to(s);
    model.go_along(objects, body.X_WT);
    model.advance(kTick_s, body.X_WT);
    if (i % 5 == 0) model.update(on_plane(script.at(s).X_WO, body.X_WT, s), body.X_WT);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, kTick_s);
    tool::LinearResponse forces = felt.response;
    constexpr double kHand_N_per_m = 300, kHand_Ns_per_m = 2, kTurn_Nm_per_rad = 1, kTurn_Nms_per_rad = 0.01;
    const glm::dvec3 turn = spatial::vector_from_rotation(body.X_WT.R);
    forces.F_To_W += spatial::to_vector6(spatial::Wrench{
        -kTurn_Nm_per_rad * turn - kTurn_Nms_per_rad * body.V_WT_W.angular_rad_s,
        -kHand_N_per_m * (body.X_WT.p + glm::dvec3(0, 0, 3e-3)) - kHand_Ns_per_m * body.V_WT_W.linear_m_s});
    const tool::StepWork stepped = tool::step(body, forces, kTick_s, tool::Integrator::kBackwardEuler);
    const Vector6 applied = tool::applied_wrench(felt.response, stepped, kTick_s);
    model.settle(applied, stepped.V_moved, kTick_s, body.X_WT);
    least_J = std::min(least_J, model.contact_port().energy_J() + model.script_work_J());
    most_script_J = std::max(most_script_J, model.script_work_J());
    largest_N = std::max(largest_N, applied.tail<3>().norm());
  }
  EXPECT_GT(largest_N, 0.5);
  EXPECT_GT(most_script_J, 2e-3) << "it did lift and drag";
  EXPECT_GT(least_J, -1e-5);
}

}  // namespace
}  // namespace farfeel::local_model
