#include "haptic_core/spatial/spatial.h"

#include <cmath>

namespace farfeel::spatial {

Pose operator*(const Pose& X_AB, const Pose& X_BC) noexcept {
  return {glm::normalize(X_AB.R * X_BC.R), X_AB.p + X_AB.R * X_BC.p};
}

Pose inverse(const Pose& X_AB) noexcept {
  const glm::dquat R_BA = glm::conjugate(X_AB.R);
  return {R_BA, -(R_BA * X_AB.p)};
}

glm::dvec3 transform_point(const Pose& X_AB, const glm::dvec3& p_B) noexcept {
  return X_AB.p + X_AB.R * p_B;
}
glm::dvec3 rotate(const Pose& X_AB, const glm::dvec3& v_B) noexcept {
  return X_AB.R * v_B;
}
glm::dvec3 rotate_back(const Pose& X_AB, const glm::dvec3& v_A) noexcept {
  return glm::conjugate(X_AB.R) * v_A;
}

glm::dquat rotation_from_vector(const glm::dvec3& v_rad) noexcept {
  const double half_angle = 0.5 * glm::length(v_rad);
  // sin(x)/x by its series where the quotient would lose digits; the next term is x^4/120 < 1e-18.
  const double half_sinc =
      half_angle < 1e-4 ? 0.5 - half_angle * half_angle / 12.0 : 0.5 * std::sin(half_angle) / half_angle;
  return {std::cos(half_angle), v_rad.x * half_sinc, v_rad.y * half_sinc, v_rad.z * half_sinc};
}

glm::dvec3 vector_from_rotation(const glm::dquat& q) noexcept {
  const double sign = q.w < 0 ? -1.0 : 1.0;  // the shorter of the two ways round
  const glm::dvec3 v{sign * q.x, sign * q.y, sign * q.z};
  const double sine = glm::length(v);
  const double cosine = sign * q.w;
  const double square = sine * sine;  // the series of 2 asin(x) / x: below 1e-2 its next term is 3e-18
  const double scale = sine < 1e-2 ? 2.0 + square * (1.0 / 3 + square * (3.0 / 20 + square * (5.0 / 56)))
                                   : 2.0 * std::atan2(sine, cosine) / sine;
  return scale * v;
}

Pose integrate(const Pose& X_AB, const Twist& V_AB_A, double dt_s) noexcept {
  return {glm::normalize(rotation_from_vector(V_AB_A.angular_rad_s * dt_s) * X_AB.R),
          X_AB.p + V_AB_A.linear_m_s * dt_s};
}

glm::dquat frame_with_z(const glm::dvec3& n_A) noexcept {
  // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
  const double sign = std::copysign(1.0, n_A.z);
  const double a = -1.0 / (sign + n_A.z);
  const double b = n_A.x * n_A.y * a;
  const glm::dvec3 x_A{1.0 + sign * n_A.x * n_A.x * a, sign * b, -sign * n_A.x};
  const glm::dvec3 y_A{b, sign + n_A.y * n_A.y * a, -n_A.y};
  return glm::normalize(glm::quat_cast(glm::dmat3{x_A, y_A, n_A}));
}

Wrench moved(const Wrench& F_P, const glm::dvec3& p_QP) noexcept {
  return {F_P.torque_Nm + glm::cross(p_QP, F_P.force_N), F_P.force_N};
}

glm::dvec3 velocity_at(const Twist& V_P, const glm::dvec3& p_PQ) noexcept {
  return V_P.linear_m_s + glm::cross(V_P.angular_rad_s, p_PQ);
}

Wrench operator+(const Wrench& a, const Wrench& b) noexcept {
  return {a.torque_Nm + b.torque_Nm, a.force_N + b.force_N};
}

Wrench operator*(double scale, const Wrench& F) noexcept {
  return {scale * F.torque_Nm, scale * F.force_N};
}

double power_W(const Wrench& F, const Twist& V) noexcept {
  return glm::dot(F.torque_Nm, V.angular_rad_s) + glm::dot(F.force_N, V.linear_m_s);
}

Vector6 to_vector6(const Wrench& F) noexcept {
  return (Vector6() << F.torque_Nm.x, F.torque_Nm.y, F.torque_Nm.z, F.force_N.x, F.force_N.y, F.force_N.z).finished();
}

Vector6 to_vector6(const Twist& V) noexcept {
  return (Vector6() << V.angular_rad_s.x, V.angular_rad_s.y, V.angular_rad_s.z, V.linear_m_s.x, V.linear_m_s.y,
          V.linear_m_s.z)
      .finished();
}

Wrench wrench_from(const Vector6& v) noexcept {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}
Twist twist_from(const Vector6& v) noexcept {
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

Eigen::Matrix3d cross_matrix(const glm::dvec3& v) noexcept {
  return (Eigen::Matrix3d() << 0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0).finished();
}

Eigen::Vector3d to_eigen(const glm::dvec3& v) noexcept {
  return {v.x, v.y, v.z};
}
glm::dvec3 to_glm(const Eigen::Vector3d& v) noexcept {
  return {v.x(), v.y(), v.z()};
}

bool is_finite(const glm::dvec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool is_valid(const Pose& X) noexcept {
  const double square = glm::dot(X.R, X.R);
  return is_finite(X.p) && std::abs(square - 1.0) <= 2e-6;  // false for NaN
}

bool is_finite(const Twist& V) noexcept {
  return is_finite(V.angular_rad_s) && is_finite(V.linear_m_s);
}
bool is_finite(const Wrench& F) noexcept {
  return is_finite(F.torque_Nm) && is_finite(F.force_N);
}

}  // namespace farfeel::spatial
