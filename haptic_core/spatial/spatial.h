// Frames, poses, twists and wrenches: the words every other folder speaks.
//
// Frames: W world, D device, T tool, S scene object, C contact, H the plane of a height chart; O is an object's own
// frame before anybody says whether it is scene or tool. X_AB is the pose of B in A, p_ABo_C the vector from A's origin
// to B's, written in C. SI units, right-handed. Six-vectors are angular first, linear second, in storage, on the wire
// and in names.
#pragma once

#include <Eigen/Core>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace farfeel::spatial {

using Vector6 = Eigen::Matrix<double, 6, 1>;  ///< angular, then linear
using Matrix6 = Eigen::Matrix<double, 6, 6>;  ///< rows and columns angular, then linear

/// A rigid pose X_AB: takes coordinates in B to coordinates in A.
struct Pose {
  glm::dquat R{1, 0, 0, 0};  ///< unit quaternion R_AB
  glm::dvec3 p{0, 0, 0};     ///< p_AB [m]: B's origin, in A

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// Velocity of a body, taken at a stated point and written in a stated frame.
struct Twist {
  glm::dvec3 angular_rad_s{0, 0, 0};
  glm::dvec3 linear_m_s{0, 0, 0};
};

/// Torque and force on a body about a stated point, written in a stated frame.
struct Wrench {
  glm::dvec3 torque_Nm{0, 0, 0};
  glm::dvec3 force_N{0, 0, 0};

  friend bool operator==(const Wrench&, const Wrench&) = default;
};

/// X_AC = X_AB X_BC. The result's quaternion is normalised, so that long products do not drift.
[[nodiscard]] Pose operator*(const Pose& X_AB, const Pose& X_BC) noexcept;
[[nodiscard]] Pose inverse(const Pose& X_AB) noexcept;
/// p_A = X_AB p_B, for points.
[[nodiscard]] glm::dvec3 transform_point(const Pose& X_AB, const glm::dvec3& p_B) noexcept;
/// v_A = R_AB v_B, for free vectors.
[[nodiscard]] glm::dvec3 rotate(const Pose& X_AB, const glm::dvec3& v_B) noexcept;
/// v_B = R_AB^T v_A.
[[nodiscard]] glm::dvec3 rotate_back(const Pose& X_AB, const glm::dvec3& v_A) noexcept;

/// exp: the rotation by |v| radians about v. Exact to rounding at and near zero.
[[nodiscard]] glm::dquat rotation_from_vector(const glm::dvec3& v_rad) noexcept;
/// log: the rotation vector of q with length in [0, pi]. Exact to rounding near zero.
[[nodiscard]] glm::dvec3 vector_from_rotation(const glm::dquat& q) noexcept;
/// The pose after moving for dt with a twist taken at the origin of B and written in A.
[[nodiscard]] Pose integrate(const Pose& X_AB, const Twist& V_AB_A, double dt_s) noexcept;
/// The frame whose z axis is the unit vector n_A and whose x axis is chosen without a branch cut near any axis of A.
[[nodiscard]] glm::dquat frame_with_z(const glm::dvec3& n_A) noexcept;

/// The same wrench about another point: F_Q = (torque + (P - Q) x f, f) with P, Q in the wrench's frame.
[[nodiscard]] Wrench moved(const Wrench& F_P, const glm::dvec3& p_QP) noexcept;
/// The velocity of the body's point Q, given its twist at P and p_PQ.
[[nodiscard]] glm::dvec3 velocity_at(const Twist& V_P, const glm::dvec3& p_PQ) noexcept;
[[nodiscard]] Wrench operator+(const Wrench&, const Wrench&) noexcept;
[[nodiscard]] Wrench operator*(double scale, const Wrench&) noexcept;
/// Power of a wrench on a twist about the same point in the same frame [W].
[[nodiscard]] double power_W(const Wrench&, const Twist&) noexcept;

[[nodiscard]] Vector6 to_vector6(const Wrench&) noexcept;
[[nodiscard]] Vector6 to_vector6(const Twist&) noexcept;
[[nodiscard]] Wrench wrench_from(const Vector6&) noexcept;
[[nodiscard]] Twist twist_from(const Vector6&) noexcept;
/// [v]x: cross_matrix(v) w = v x w.
[[nodiscard]] Eigen::Matrix3d cross_matrix(const glm::dvec3& v) noexcept;
[[nodiscard]] Eigen::Vector3d to_eigen(const glm::dvec3& v) noexcept;
[[nodiscard]] glm::dvec3 to_glm(const Eigen::Vector3d& v) noexcept;

[[nodiscard]] bool is_finite(const glm::dvec3&) noexcept;
/// Finite everywhere, and the quaternion's length is 1 within 1e-6.
[[nodiscard]] bool is_valid(const Pose&) noexcept;
[[nodiscard]] bool is_finite(const Twist&) noexcept;
[[nodiscard]] bool is_finite(const Wrench&) noexcept;

}  // namespace farfeel::spatial
