// Contacts that answer for where the tool was, long ago or a few ticks: in part they tell it what it did itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

#include "haptic_core/local_model/local_model.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Vector6;

constexpr double kTick_s = 1e-3;
constexpr double kOff_m = 1e-4;  // where the tool is let go, off the middle

/// To, a point, in a bowl z = x^2 / (2 R).
contact::ContactSet in_bowl(const Pose& X_WT, double R_m) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  set.count = 1;
  contact::Contact& contact = set.contacts[0];
  const double x_m = X_WT.p.x;
  contact.nhat_ST_W = glm::normalize(glm::dvec3(-x_m / R_m, 0, 1));
  contact.p_WC_W = X_WT.p;
  contact.depth_m = (x_m * x_m / (2 * R_m) - X_WT.p.z) * contact.nhat_ST_W.z;
  contact.gradient = spatial::to_vector6(spatial::Twist{{}, -contact.nhat_ST_W});
  contact.lateral_range_m = 1e-3;
  contact.material = {.stiffness_N_per_m = 2000, .damping_Ns_per_m = 1, .static_friction = 0, .dynamic_friction = 0};
  return set;
}

/// The same as texture: what the point is pressed out with is the slope's.
contact::ContactSet in_groove(const Pose& X_WT, double R_m) {
  contact::ContactSet set = in_bowl(X_WT, R_m);
  contact::Contact& contact = set.contacts[0];
  contact.depth_m /= contact.nhat_ST_W.z;
  contact.nhat_ST_W = {0, 0, 1};
  contact.gradient = spatial::to_vector6(spatial::Twist{{}, {X_WT.p.x / R_m, 0, -1}});
  return set;
}

struct Swing {
  double first_m = 0, last_m = 0;  ///< farthest from the middle in the first and the last half second
};

struct News {
  double tick_s = kTick_s;
  int delay_ticks = 1;
  int every_ticks = 1;
};

/// A tool of 100 g, held by a coupling and pressed with 2 N into what it is told of, is let go. The coupling alone
/// rings at 22 Hz and is damped a little.
template <typename Told>
Swing pressed_into(Told told, const News& news) {
  constexpr double kHold_N_per_m = 2000, kHold_Ns_per_m = 1, kPress_N = 2;
  const double tick_s = news.tick_s;
  tool::RigidTool body{{0.1, Eigen::Matrix3d::Identity() * 1e-5}, {{1, 0, 0, 0}, {kOff_m, 0, -1e-3}}, {}};
  LocalModel model{LocalModelSettings{}};
  std::deque<Pose> under_way;
  Swing swing;
  const int half_second = static_cast<int>(std::lround(0.5 / tick_s)), ticks = 8 * half_second;
  for (int i = 0; i < ticks; ++i) {
    model.advance(tick_s, body.X_WT);
    under_way.push_back(body.X_WT);
    if (std::ssize(under_way) > news.delay_ticks) under_way.pop_front();
    if (i % news.every_ticks == 0) model.update(told(under_way.front()), body.X_WT, news.delay_ticks * tick_s);
    const Felt felt = model.evaluate(body.X_WT, body.V_WT_W, tick_s);
    tool::LinearResponse forces = felt.response;
    const glm::dvec3 hold_N = -kHold_N_per_m * (body.X_WT.p + glm::dvec3(0, 0, 1e-3)) -
                              kHold_Ns_per_m * body.V_WT_W.linear_m_s - glm::dvec3(0, 0, kPress_N);
    forces.F_To_W += spatial::to_vector6(spatial::Wrench{{}, hold_N});
    forces.by_pose.bottomRightCorner<3, 3>() -= kHold_N_per_m * Eigen::Matrix3d::Identity();
    forces.by_twist.bottomRightCorner<3, 3>() -= kHold_Ns_per_m * Eigen::Matrix3d::Identity();
    const tool::StepWork stepped = tool::step(body, forces, tick_s);
    model.settle(tool::applied_wrench(felt.response, stepped, tick_s), stepped.V_moved, tick_s, body.X_WT);
    double& farthest_m = i < half_second ? swing.first_m : swing.last_m;
    if (i < half_second || i >= ticks - half_second) farthest_m = std::max(farthest_m, std::abs(body.X_WT.p.x));
  }
  return swing;
}

TEST(OldNewsTest, AToolDoesNotSwingOnByTheEchoOfItsSwing) {
  for (const int delay_ticks : {1, 50, 100, 200, 400}) {
    const Swing swing =
        pressed_into([](const Pose& X_WT) { return in_bowl(X_WT, 4e-3); }, {.delay_ticks = delay_ticks});
    EXPECT_GT(swing.first_m, kOff_m / 2) << delay_ticks;
    EXPECT_LT(swing.last_m, kOff_m / 5) << delay_ticks;
  }
}

const Pose kRest{{1, 0, 0, 0}, {0, 0, -0.3e-3}};

/// Of a plane that the tool's point is 0.3 mm deep in at rest.
contact::ContactSet on_plane(const Pose& X_WT, const glm::dvec3& nhat_W) {
  contact::ContactSet set;
  set.X_WT = X_WT;
  set.count = 1;
  contact::Contact& contact = set.contacts[0];
  contact.nhat_ST_W = nhat_W;
  contact.p_WC_W = X_WT.p;
  contact.depth_m = 0.3e-3 - glm::dot(X_WT.p - kRest.p, nhat_W);
  contact.gradient = spatial::to_vector6(spatial::Twist{{}, -nhat_W});
  contact.lateral_range_m = 1e-3;
  contact.material = {.stiffness_N_per_m = 2000, .damping_Ns_per_m = 1, .static_friction = 0, .dynamic_friction = 0};
  return set;
}

// The plane turns by 17 degrees as it is told: the direction follows slowly, and meanwhile every answer says the same
// of where the tool is, wherever it was when it was answered.
TEST(OldNewsTest, ADepthDoesNotSwingAsTheToolDidWhenItWasTold) {
  constexpr double kAge_s = 0.2, kSwing_m = 0.2e-3, kSwing_Hz = 40;
  LocalModel model{LocalModelSettings{}};
  double least_N = 1e9, most_N = 0;
  for (int i = 0; i < 300; ++i) {
    Pose X_then_WT = kRest;
    X_then_WT.p.x += kSwing_m * std::sin(2 * std::numbers::pi * kSwing_Hz * kTick_s * i);
    const glm::dvec3 nhat_W = i < 200 ? glm::dvec3(0, 0, 1) : glm::normalize(glm::dvec3(0.3, 0, 1));
    model.advance(kTick_s, kRest);
    model.update(on_plane(X_then_WT, nhat_W), kRest, kAge_s);
    if (i < 200) continue;
    const double force_N = model.evaluate(kRest, {}, kTick_s).response.F_To_W.tail<3>().norm();
    least_N = std::min(least_N, force_N), most_N = std::max(most_N, force_N);
  }
  EXPECT_LT(most_N - least_N, 0.01) << "of 0.6 N";
}

TEST(OldNewsTest, TheOlderTheyAreTheMoreTheContactDamps) {
  const auto damping_Ns_per_m = [&](double age_s, double mass_kg) {
    LocalModelSettings settings;
    settings.tool_mass_kg = mass_kg;
    LocalModel model{settings};
    for (int i = 0; i < 200; ++i) {
      model.advance(kTick_s, kRest);
      model.update(on_plane(kRest, {0, 0, 1}), kRest, age_s);
    }
    return -model.evaluate(kRest, {}, kTick_s).response.by_twist(5, 5);
  };
  EXPECT_DOUBLE_EQ(damping_Ns_per_m(0, 0.1), 1);
  EXPECT_GT(damping_Ns_per_m(0.02, 0.1), 1.5);
  EXPECT_GT(damping_Ns_per_m(0.2, 0.1), 5) << "of 28 that are critical";
  EXPECT_LT(damping_Ns_per_m(0.2, 0.1), 14);
  EXPECT_LT(damping_Ns_per_m(0.2, 0.001), 2) << "what is light is not held back";
}

/// At 5 kHz hardly anything but the coupling damps: what is held between answers, late by half of that, must not swing
/// the tool on.
TEST(OldNewsTest, AHeavyToolInASharpGrooveDoesNotSwingOnByWhatIsHeldBetweenAnswers) {
  for (const int every_ticks : {1, 5, 10}) {
    const Swing swing = pressed_into([](const Pose& X_WT) { return in_groove(X_WT, 0.2e-3); },
                                     {.tick_s = 2e-4, .every_ticks = every_ticks});
    EXPECT_GT(swing.first_m, kOff_m / 2) << every_ticks;
    EXPECT_LT(swing.last_m, kOff_m / 5) << every_ticks;
  }
}

/// Of the force across a groove after answers so far apart, with the way across it: what the slope's turn adds to it.
double turning_N_per_m(int every_ticks) {
  LocalModel model{LocalModelSettings{}};
  Pose X_WT{{1, 0, 0, 0}, {0, 0, -0.3e-3}};
  for (int i = 0; i <= 20 * every_ticks; ++i) {
    X_WT.p.x = 5e-6 * i;
    model.advance(kTick_s, X_WT);
    if (i % every_ticks == 0) model.update(in_groove(X_WT, 1e-3), X_WT);
  }
  const contact::Contact told = in_groove(X_WT, 1e-3).contacts[0];
  const double by_slope = -told.material.stiffness_N_per_m * told.gradient[3] * told.gradient[3];
  return model.evaluate(X_WT, {}, kTick_s).response.by_pose(3, 3) - by_slope;
}

TEST(OldNewsTest, WhereEveryTickIsAnsweredNothingIsGuessedBetween) {
  EXPECT_NEAR(turning_N_per_m(1), 0, 1);
  EXPECT_LT(turning_N_per_m(5), -100);
}

}  // namespace
}  // namespace farfeel::local_model
