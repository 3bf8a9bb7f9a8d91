// A point r = p - To of T moves by  m = tau + theta x r + theta x (theta x r) / 2  (to second order). Over a fixed
// (u, v) the surface's height changes, with N = (-z_u, -z_v, 1) and Z the second derivative of z, by
//   dz = N . (m - theta x D) + (m_u, m_v) Z (m_u, m_v)^T / 2,    D = (m_u, m_v, z_u m_u + z_v m_v),
// where D is where the point now over (u, v) came from, with m its first-order part. Overlap falls as T rises: the
// results are the negatives.
#include "haptic_core/penetration/pose_derivatives.h"

namespace farfeel::penetration {
namespace {

glm::dvec3 scaled_normal(const HeightAlong& t) {
  return {-t.z_u, -t.z_v, 1};
}

spatial::Vector6 stacked(const glm::dvec3& angular, const glm::dvec3& linear) {
  return spatial::to_vector6(spatial::Wrench{angular, linear});
}

}  // namespace

spatial::Vector6 overlap_gradient(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept {
  const glm::dvec3 N = scaled_normal(t);
  return stacked(-glm::cross(p_ToQ_C, N), -N);
}

Matrix62 overlap_gradient_slopes(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept {
  const glm::dvec3 N = scaled_normal(t);
  const glm::dvec3 N_u{-t.z_uu_1_per_m, -t.z_uv_1_per_m, 0}, N_v{-t.z_uv_1_per_m, -t.z_vv_1_per_m, 0};
  Matrix62 slopes;
  slopes.col(0) = stacked(-glm::cross(glm::dvec3{1, 0, t.z_u}, N) - glm::cross(p_ToQ_C, N_u), -N_u);
  slopes.col(1) = stacked(-glm::cross(glm::dvec3{0, 1, t.z_v}, N) - glm::cross(p_ToQ_C, N_v), -N_v);
  return slopes;
}

spatial::Matrix6 overlap_hessian(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept {
  using Matrix36 = Eigen::Matrix<double, 3, 6>;
  const glm::dvec3 N = scaled_normal(t);
  const Eigen::Vector3d r = spatial::to_eigen(p_ToQ_C), n = spatial::to_eigen(N);
  Matrix36 J;  // first-order motion of the surface point
  J << -spatial::cross_matrix(p_ToQ_C), Eigen::Matrix3d::Identity();
  Matrix36 D;
  D.row(0) = J.row(0);
  D.row(1) = J.row(1);
  D.row(2) = t.z_u * J.row(0) + t.z_v * J.row(1);

  spatial::Matrix6 rise = spatial::Matrix6::Zero();  // second derivative of z_T
  rise.topLeftCorner<3, 3>() = 0.5 * (r * n.transpose() + n * r.transpose()) - r.dot(n) * Eigen::Matrix3d::Identity();
  // N . (theta x D) = theta . (D x N) = -theta^T [N]x D
  spatial::Matrix6 carried = spatial::Matrix6::Zero();
  carried.topRows<3>() = spatial::cross_matrix(N) * D;
  rise += carried + carried.transpose();
  Eigen::Matrix2d Z;
  Z << t.z_uu_1_per_m, t.z_uv_1_per_m, t.z_uv_1_per_m, t.z_vv_1_per_m;
  rise += J.topRows<2>().transpose() * Z * J.topRows<2>();
  return -rise;
}

spatial::Vector6 edge_distance_gradient(const EdgeFade& fade, const glm::dvec3& p_ToFoot_C) noexcept {
  const glm::dvec3 inward{fade.inward, 0};
  return stacked(-glm::cross(p_ToFoot_C, inward), -inward);
}

}  // namespace farfeel::penetration
