#include "haptic_core/tool/rigid_tool.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::tool {
namespace {

using spatial::Matrix6;
using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

class RigidToolTest : public ::testing::Test {
 protected:
  glm::dvec3 vector(double size) { return size * glm::dvec3(uniform_(random_), uniform_(random_), uniform_(random_)); }
  Pose pose(double angle, double length) { return {spatial::rotation_from_vector(vector(angle)), vector(length)}; }

  /// A flat, file-like body: three different moments.
  MassProperties body(double mass_kg) {
    return with_mass({0.2, Eigen::Vector3d(1.1e-5, 6.7e-4, 6.8e-4).asDiagonal()}, mass_kg);
  }
  /// A unilateral stiff plane z >= 0 that touches four corners of the body, with damping.
  static LinearResponse on_plane(const RigidTool& tool, double stiffness_N_per_m, double& energy_J) {
    LinearResponse sum;
    energy_J = 0;
    for (const glm::dvec3& corner : {glm::dvec3(0.1, 0.012, 0), glm::dvec3(0.1, -0.012, 0), glm::dvec3(-0.1, 0.012, 0),
                                     glm::dvec3(-0.1, -0.012, 0)}) {
      const glm::dvec3 r = spatial::rotate(tool.X_WT, corner);
      const double depth = -(tool.X_WT.p.z + r.z);
      if (depth <= 0) continue;
      Vector6 gradient;  // of depth: -(r x z), -z
      gradient << -r.y, r.x, 0, 0, 0, -1;
      sum.F_To_W -= stiffness_N_per_m * depth * gradient;
      sum.by_pose -= stiffness_N_per_m * gradient * gradient.transpose();
      energy_J += 0.5 * stiffness_N_per_m * depth * depth;
    }
    return sum;
  }

  std::mt19937 random_{5};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(RigidToolTest, FreeSpinNeverGainsEnergyAndKeepsLinearMomentum) {
  for (double mass : {0.001, 0.1}) {
    RigidTool tool{body(mass), pose(2, 1), {vector(30), vector(1)}};
    const glm::dvec3 v = tool.V_WT_W.linear_m_s;
    double before = kinetic_energy_J(tool);
    for (int i = 0; i < 2000; ++i) {
      const double after = step(tool, {}, 1e-3).kinetic_J;
      ASSERT_LE(after, before * (1 + 1e-12));
      before = after;
    }
    EXPECT_LE(glm::length(tool.V_WT_W.linear_m_s - v), 1e-12);
    EXPECT_TRUE(spatial::is_valid(tool.X_WT));
  }
}

TEST_F(RigidToolTest, FallsLikeAParabolaUnderAConstantForce) {
  RigidTool tool{body(0.1), {}, {}};
  LinearResponse gravity;
  gravity.F_To_W[5] = -0.981;
  for (int i = 0; i < 1000; ++i) step(tool, gravity, 1e-3);
  EXPECT_NEAR(tool.V_WT_W.linear_m_s.z, -9.81, 1e-9);
  EXPECT_NEAR(tool.X_WT.p.z, -4.905, 0.01);
}

TEST_F(RigidToolTest, HeldByTheCouplingOverAStiffPlaneItMakesNoEnergyAtAnyMassAndRate) {
  for (double mass : {0.001, 0.01, 0.1})
    for (double dt : {1e-3, 0.2e-3})
      for (double stiffness : {500.0, 20000.0}) {
        const VirtualCoupling coupling({2000, 5, 8, 0.03}, {{1, 0, 0, 0}, vector(0.03)});
        const Pose X_WD{spatial::rotation_from_vector(vector(0.1)), {0, 0, -0.001}};
        RigidTool tool{body(mass), pose(0.4, 0.01), {vector(5), vector(0.3)}};
        const auto energy_J = [&] {
          double contact_J = 0;
          (void)on_plane(tool, stiffness, contact_J);
          return kinetic_energy_J(tool) + contact_J + coupling.evaluate(X_WD, {}, tool.X_WT, tool.V_WT_W).energy_J;
        };
        const double at_start = energy_J();
        for (int i = 0; i < 0.5 / dt; ++i) {
          double contact_J = 0;
          LinearResponse forces = on_plane(tool, stiffness, contact_J);
          forces += coupling.evaluate(X_WD, {}, tool.X_WT, tool.V_WT_W).on_tool;
          step(tool, forces, dt);
          const double now = energy_J();
          // A corner that meets the plane inside a step was not in that step's linearisation: allow what such
          // a corner can store, a small share of what is there, never growth beyond the start.
          ASSERT_LE(now, at_start * 1.02 + 1e-9) << mass << ' ' << dt << ' ' << stiffness;
        }
        EXPECT_LE(kinetic_energy_J(tool), 1e-4 * at_start) << mass << ' ' << dt << ' ' << stiffness;
      }
}

TEST_F(RigidToolTest, MidpointKeepsAnOscillatorsEnergyWhereBackwardEulerLosesIt) {
  const auto share_left = [&](Integrator integrator, double damping) {
    RigidTool tool{body(0.05), {}, {{0, 0, 0}, {0.1, 0, 0}}};
    const double at_start = kinetic_energy_J(tool);
    const auto energy_J = [&] { return kinetic_energy_J(tool) + 0.5 * 1000 * glm::dot(tool.X_WT.p, tool.X_WT.p); };
    double last = at_start;
    for (int i = 0; i < 1000; ++i) {
      LinearResponse spring;
      spring.F_To_W.tail<3>() =
          -1000 * spatial::to_eigen(tool.X_WT.p) - damping * spatial::to_eigen(tool.V_WT_W.linear_m_s);
      spring.by_pose.bottomRightCorner<3, 3>() = -1000 * Eigen::Matrix3d::Identity();
      spring.by_twist.bottomRightCorner<3, 3>() = -damping * Eigen::Matrix3d::Identity();
      step(tool, spring, 1e-3, integrator);
      EXPECT_LE(energy_J(), last * (1 + 1e-12));
      last = energy_J();
    }
    return last / at_start;
  };
  EXPECT_NEAR(share_left(Integrator::kMidpoint, 0), 1, 1e-9);
  EXPECT_LE(share_left(Integrator::kBackwardEuler, 0), 1e-3);
  // With a damper, the midpoint rule decays as the real thing does: exp(-b t / m).
  EXPECT_NEAR(share_left(Integrator::kMidpoint, 0.1), std::exp(-0.1 / 0.05), 0.01);
}

// What a contact's port passes is then what it stores, whatever the step; backward Euler loses some of the body's own.
TEST_F(RigidToolTest, ASpringThatPushesWithItsMeanTakesExactlyWhatItStores) {
  for (Integrator integrator : {Integrator::kBackwardEuler, Integrator::kMidpoint}) {
    for (const double stiffness : {300.0, 10'000.0, 300'000.0}) {
      RigidTool tool{body(0.02), {}, {{0, 0, 0}, {0.1, 0, 0}}};
      const auto stored_J = [&] { return 0.5 * stiffness * glm::dot(tool.X_WT.p, tool.X_WT.p); };
      for (int i = 0; i < 200; ++i) {
        const double before_J = stored_J(), all_J = before_J + kinetic_energy_J(tool);
        LinearResponse spring;
        spring.F_To_W.tail<3>() = -stiffness * spatial::to_eigen(tool.X_WT.p);
        spring.mean_by_way.bottomRightCorner<3, 3>() = -0.5 * stiffness * Eigen::Matrix3d::Identity();
        const StepWork stepped = step(tool, spring, 1e-3, integrator);
        const double work_J = -applied_wrench(spring, stepped, 1e-3).dot(stepped.V_moved) * 1e-3;
        ASSERT_NEAR(work_J, stored_J() - before_J, 1e-12 * (1 + stiffness));
        ASSERT_LE(stored_J() + kinetic_energy_J(tool), all_J * (1 + 1e-9) + 1e-18);
      }
    }
  }
}

TEST_F(RigidToolTest, WorkOfTheAppliedWrenchIsTheChangeOfKineticEnergy) {
  for (Integrator integrator : {Integrator::kBackwardEuler, Integrator::kMidpoint}) {
    RigidTool tool{body(0.05), {}, {{0, 0, 0}, {0.3, -0.2, 0.1}}};
    LinearResponse forces;
    forces.F_To_W << 0, 0, 0, 1, 2, -3;
    forces.by_pose.bottomRightCorner<3, 3>() = -800 * Eigen::Matrix3d::Identity();
    forces.mean_by_way.bottomRightCorner<3, 3>() = -500 * Eigen::Matrix3d::Identity();
    forces.by_twist.bottomRightCorner<3, 3>() = -2 * Eigen::Matrix3d::Identity();
    const double before = kinetic_energy_J(tool);
    const StepWork stepped = step(tool, forces, 1e-3, integrator);
    const double work = applied_wrench(forces, stepped, 1e-3).dot(stepped.V_moved) * 1e-3;
    // Backward Euler loses |dV|^2 m / 2 on the way.
    const double lost = (stepped.share - 0.5) * 0.05 * stepped.V_change.squaredNorm();
    EXPECT_NEAR(stepped.kinetic_J - before, work - lost, 1e-12);
  }
}

TEST_F(RigidToolTest, ProjectionKeepsGoodMatricesAndLiftsBadOnes) {
  for (int i = 0; i < 100; ++i) {
    const Matrix6 any = Matrix6::NullaryExpr([&] { return uniform_(random_); });
    const Matrix6 good = any * any.transpose();
    EXPECT_LE((with_positive_symmetric_part(good, 0.05) - good).norm(), 1e-12);
    const Matrix6 lifted = with_positive_symmetric_part(any, 0.05);
    const Matrix6 symmetric = 0.5 * (lifted + lifted.transpose());
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Matrix6>(symmetric).eigenvalues().minCoeff(), -1e-9);
    EXPECT_LE(((lifted - lifted.transpose()) - (any - any.transpose())).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace farfeel::tool
