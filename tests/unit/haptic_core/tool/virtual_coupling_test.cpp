#include "haptic_core/tool/virtual_coupling.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::tool {
namespace {

using spatial::Matrix6;
using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

class VirtualCouplingTest : public ::testing::Test {
 protected:
  glm::dvec3 vector(double size) { return size * glm::dvec3(uniform_(random_), uniform_(random_), uniform_(random_)); }
  Pose pose(double angle, double length) { return {spatial::rotation_from_vector(vector(angle)), vector(length)}; }
  Twist twist() { return {vector(5), vector(0.5)}; }

  std::mt19937 random_{11};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

Pose nudged(const Pose& X, const Vector6& d) {
  return spatial::integrate(X, spatial::twist_from(d), 1);
}

TEST_F(VirtualCouplingTest, JacobiansMatchFiniteDifferences) {
  for (int i = 0; i < 100; ++i) {
    const VirtualCoupling coupling({1000, 2, 5, 0.01}, pose(1, 0.05));
    const Pose X_WT = pose(2, 0.1), X_WD = coupling.rest_pose(spatial::inverse(pose(0.3, 0.01))) * X_WT;
    const Twist V_WT = twist(), V_WD = twist();
    const auto at = [&](const Vector6& dX, const Vector6& dV) {
      return coupling.evaluate(X_WD, V_WD, nudged(X_WT, dX), spatial::twist_from(spatial::to_vector6(V_WT) + dV))
          .on_tool;
    };
    const LinearResponse here = at(Vector6::Zero(), Vector6::Zero());
    Matrix6 by_pose, by_twist;
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6 d = kStep * Vector6::Unit(axis);
      by_pose.col(axis) = (at(d, Vector6::Zero()).F_To_W - at(-d, Vector6::Zero()).F_To_W) / (2 * kStep);
      by_twist.col(axis) = (at(Vector6::Zero(), d).F_To_W - at(Vector6::Zero(), -d).F_To_W) / (2 * kStep);
    }
    EXPECT_LE((by_pose - here.by_pose).norm(), 1e-6 * (1 + here.by_pose.norm()));
    EXPECT_LE((by_twist - here.by_twist).norm(), 1e-8 * (1 + here.by_twist.norm()));
  }
}

TEST_F(VirtualCouplingTest, RestsWhereNothingPulls) {
  const VirtualCoupling coupling({}, pose(1, 0.05));
  const Pose X_WD = pose(2, 0.2);
  const auto state = coupling.evaluate(X_WD, {}, coupling.rest_pose(X_WD), {});
  EXPECT_LE(state.on_tool.F_To_W.norm(), 1e-11);
  EXPECT_LE(state.energy_J, 1e-24);
}

TEST_F(VirtualCouplingTest, WhatHandAndToolDoIsStoredOrDissipated) {
  // P_on_tool + P_on_hand = -dU/dt - (b_t |de/dt|^2 + b_r |w_h - w|^2) <= -dU/dt.
  for (int i = 0; i < 100; ++i) {
    const CouplingGains gains{1000, 2, 5, 0.01};
    const VirtualCoupling coupling(gains, pose(1, 0.05));
    const Pose X_WT = pose(2, 0.1), X_WD = X_WT * pose(0.3, 0.02);
    const Twist V_WT = twist(), V_WD = twist();
    const auto state = coupling.evaluate(X_WD, V_WD, X_WT, V_WT);
    const double power =
        spatial::power_W(spatial::wrench_from(state.on_tool.F_To_W), V_WT) + spatial::power_W(state.F_hand_W, V_WD);
    constexpr double kStep = 1e-6;
    const auto energy_after = [&](double dt) {
      return coupling.evaluate(spatial::integrate(X_WD, V_WD, dt), V_WD, spatial::integrate(X_WT, V_WT, dt), V_WT)
          .energy_J;
    };
    const double stored_W = (energy_after(kStep) - energy_after(-kStep)) / (2 * kStep);
    EXPECT_LE(power, -stored_W + 1e-6);
    const double dissipated_W = -power - stored_W;
    const glm::dvec3 dw = V_WD.angular_rad_s - V_WT.angular_rad_s;
    EXPECT_GE(dissipated_W, gains.rotational_damping_Nms_per_rad * glm::dot(dw, dw) - 1e-6);
  }
}

}  // namespace
}  // namespace farfeel::tool
