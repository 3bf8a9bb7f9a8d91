// The gyroscopic torque -w x I w is linearised like every other force, -([w] I - [I w]) dw, after E. Catto, GDC 2015:
// one Newton step of backward Euler in the body's frame, which a constant twist during the step makes the same in W.
#include "haptic_core/tool/rigid_tool.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace farfeel::tool {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using spatial::Matrix6;
using spatial::Vector6;

Matrix3d rotation_matrix(const glm::dquat& q) {
  return Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
}

Matrix3d inertia_W(const RigidTool& tool) {
  const Matrix3d R_WT = rotation_matrix(tool.X_WT.R);
  return R_WT * tool.body.inertia_To_T * R_WT.transpose();
}

bool is_positive_semidefinite(const Matrix6& symmetric) {
  const double scale = symmetric.diagonal().cwiseAbs().maxCoeff();
  if (scale == 0) return symmetric.isZero(0);
  return Eigen::LLT<Matrix6>(symmetric + 1e-12 * scale * Matrix6::Identity()).info() == Eigen::Success;
}

}  // namespace

MassProperties with_mass(const MassProperties& body, double mass_kg) {
  return {mass_kg, body.inertia_To_T * (mass_kg / body.mass_kg)};
}

double kinetic_energy_J(const RigidTool& tool) noexcept {
  const Vector3d w = spatial::to_eigen(tool.V_WT_W.angular_rad_s);
  return 0.5 *
         (w.dot(inertia_W(tool) * w) + tool.body.mass_kg * glm::dot(tool.V_WT_W.linear_m_s, tool.V_WT_W.linear_m_s));
}

Matrix6 with_positive_symmetric_part(const Matrix6& matrix, double arm_m) noexcept {
  Vector6 scale;
  scale << Vector3d::Constant(1 / arm_m), Vector3d::Ones();
  const Matrix6 transpose = matrix.transpose();
  const Matrix6 symmetric = scale.asDiagonal() * Matrix6(0.5 * (matrix + transpose)) * scale.asDiagonal();
  if (is_positive_semidefinite(symmetric)) return matrix;
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(symmetric);
  const Matrix6 projected =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
  const Vector6 unscale = scale.cwiseInverse();
  return unscale.asDiagonal() * projected * unscale.asDiagonal() + 0.5 * (matrix - transpose);
}

LinearStep linear_step(const RigidTool& tool, const LinearResponse& forces, double dt_s,
                       Integrator integrator) noexcept {
  const double mass = tool.body.mass_kg;
  const double share = integrator == Integrator::kMidpoint ? 0.5 : 1.0;
  const double h = share * dt_s;
  const Matrix3d I_W = inertia_W(tool);
  const Vector3d w = spatial::to_eigen(tool.V_WT_W.angular_rad_s);
  const Vector3d angular_momentum = I_W * w;

  Matrix6 M = Matrix6::Zero();
  M.topLeftCorner<3, 3>() = I_W;
  M.bottomRightCorner<3, 3>() = mass * Matrix3d::Identity();
  const double arm_m = std::sqrt(std::max(I_W.trace() / (3 * mass), 1e-6));  // radius of gyration, at least 1 mm
  const Matrix6 K = with_positive_symmetric_part(-forces.by_pose - forces.mean_by_way / share, arm_m);
  const Matrix6 B = with_positive_symmetric_part(-forces.by_twist, arm_m);
  Matrix6 gyroscopic = Matrix6::Zero();
  gyroscopic.topLeftCorner<3, 3>() =
      spatial::cross_matrix(tool.V_WT_W.angular_rad_s) * I_W - spatial::cross_matrix(spatial::to_glm(angular_momentum));

  const Vector6 V = spatial::to_vector6(tool.V_WT_W);
  Vector6 W = forces.F_To_W;
  W.head<3>() -= w.cross(angular_momentum);
  const Matrix6 A = M + h * (B + gyroscopic) + h * h * K;
  return {A, dt_s * (W - h * (K * V)), V, share, dt_s};
}

StepWork take(RigidTool& tool, const LinearStep& step, const Vector6& V_change) noexcept {
  const Vector6& V = step.V_begun;
  const Vector6 V_moved = V + step.share * V_change;
  tool.V_WT_W = spatial::twist_from(V + V_change);
  tool.X_WT = spatial::integrate(tool.X_WT, spatial::twist_from(V_moved), step.dt_s);
  return {V_moved, V_change, step.share, kinetic_energy_J(tool)};
}

StepWork step(RigidTool& tool, const LinearResponse& forces, double dt_s, Integrator integrator) noexcept {
  const LinearStep linear = linear_step(tool, forces, dt_s, integrator);
  return take(tool, linear, linear.A.partialPivLu().solve(linear.impulse));
}

Vector6 applied_wrench(const LinearResponse& forces, const StepWork& stepped, double dt_s) noexcept {
  return forces.F_To_W + dt_s * (forces.mean_by_way * stepped.V_moved) +
         stepped.share * (dt_s * (forces.by_pose * stepped.V_moved) + forces.by_twist * stepped.V_change);
}

}  // namespace farfeel::tool
