// Jacobians for R <- exp(dtheta) R, by columns (rotation, translation); [a] is the cross matrix of a:
//   f:    by x: -k_t I          by theta: k_t [c] + b_t [w][c]           by v: -b_t I      by w: b_t [c]
//   tau:  by x: -k_t [c]        by theta: [c] f_theta + [f][c] - k_r Jr^-1(theta)
//         by v: -b_t [c]        by w: b_t [c][c] - b_r I
// since dc = dtheta x c, d(w x c) = w x (dtheta x c) = -[w][c] dtheta, and log(R_h R^T exp(-d)) = theta - Jr^-1 d.
#include "haptic_core/tool/virtual_coupling.h"

#include <cmath>

namespace farfeel::tool {
namespace {

using Eigen::Matrix3d;

/// Inverse of the right Jacobian of exp at theta: d log(exp(theta) exp(d)) / dd.
Matrix3d inverse_right_jacobian(const glm::dvec3& theta) {
  const double angle = glm::length(theta);
  // The coefficient of [theta]^2 by its series near zero; the next term is angle^4 / 30240.
  const double coefficient = angle < 1e-2 ? 1.0 / 12 + angle * angle / 720
                                          : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  const Matrix3d t = spatial::cross_matrix(theta);
  return Matrix3d::Identity() + 0.5 * t + coefficient * t * t;
}

}  // namespace

spatial::Pose VirtualCoupling::rest_pose(const spatial::Pose& X_WD) const noexcept {
  return X_WD * spatial::inverse(X_TG_);
}

VirtualCoupling::State VirtualCoupling::evaluate(const spatial::Pose& X_WD, const spatial::Twist& V_WD_W,
                                                 const spatial::Pose& X_WT,
                                                 const spatial::Twist& V_WT_W) const noexcept {
  const auto [k_t, b_t, k_r, b_r] = gains_;
  const glm::dvec3 c = spatial::rotate(X_WT, X_TG_.p);
  const glm::dvec3 w = V_WT_W.angular_rad_s;
  const glm::dvec3 e = X_WD.p - X_WT.p - c;
  const glm::dvec3 theta = spatial::vector_from_rotation(X_WD.R * glm::conjugate(X_WT.R * X_TG_.R));
  const glm::dvec3 f = k_t * e + b_t * (V_WD_W.linear_m_s - spatial::velocity_at(V_WT_W, c));
  const glm::dvec3 couple = k_r * theta + b_r * (V_WD_W.angular_rad_s - w);

  State state;
  state.on_tool.F_To_W = spatial::to_vector6(spatial::Wrench{glm::cross(c, f) + couple, f});
  state.F_hand_W = {-couple, -f};
  state.energy_J = 0.5 * (k_t * glm::dot(e, e) + k_r * glm::dot(theta, theta));

  const Matrix3d identity = Matrix3d::Identity(), c_x = spatial::cross_matrix(c);
  const Matrix3d f_theta = k_t * c_x + b_t * spatial::cross_matrix(w) * c_x;
  auto& by_pose = state.on_tool.by_pose;
  by_pose.topLeftCorner<3, 3>() = c_x * f_theta + spatial::cross_matrix(f) * c_x - k_r * inverse_right_jacobian(theta);
  by_pose.topRightCorner<3, 3>() = -k_t * c_x;
  by_pose.bottomLeftCorner<3, 3>() = f_theta;
  by_pose.bottomRightCorner<3, 3>() = -k_t * identity;
  auto& by_twist = state.on_tool.by_twist;
  by_twist.topLeftCorner<3, 3>() = b_t * c_x * c_x - b_r * identity;
  by_twist.topRightCorner<3, 3>() = -b_t * c_x;
  by_twist.bottomLeftCorner<3, 3>() = b_t * c_x;
  by_twist.bottomRightCorner<3, 3>() = -b_t * identity;
  return state;
}

}  // namespace farfeel::tool
