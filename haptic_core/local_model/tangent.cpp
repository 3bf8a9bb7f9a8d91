#include "haptic_core/local_model/tangent.h"

namespace farfeel::local_model {

Tangent::Turned Tangent::turned_to(const spatial::Pose& X_WT) const noexcept {
  const glm::dquat by = glm::normalize(X_WT.R * glm::conjugate(X0_WT.R));
  return {by, spatial::vector_from_rotation(by)};
}

Tangent::At Tangent::at(const spatial::Pose& X_WT, const Turned& turned) const noexcept {
  At at;
  at.p_ToC_W = turned.by * (p_WC_W - X0_WT.p);
  const glm::dvec3 m = X_WT.p + at.p_ToC_W - p_WC_W;
  const double m_n = glm::dot(m, nhat_W);
  const glm::dvec3 l = at.moved_W = m - m_n * nhat_W;
  const double l_length = glm::length(l);
  const bool is_clamped = l_length > range_m;
  const double s = is_clamped ? range_m / l_length : 1;

  const glm::dvec3 theta = at.turned_W = turned.theta_W;
  // The rotation vector's own derivative, Jl^-T(theta) c to the second order: theta turns on while the tool turns.
  const glm::dvec3 couple_turned = glm::cross(theta, couple_W);
  const glm::dvec3 couple = s * (couple_W + 0.5 * couple_turned + glm::cross(theta, couple_turned) / 12.0);
  glm::dvec3 slope = s * slope_W;
  at.depth_m = depth_m - m_n + s * (glm::dot(slope_W, l) + glm::dot(couple_W, theta));
  if (is_clamped) {  // along l nothing rises any more, and less is left of the couple
    slope -= (glm::dot(slope, l) + s * glm::dot(couple_W, theta)) / (l_length * l_length) * l;
    slope -= fall / l_length * l;
    at.depth_m -= fall * (l_length - range_m);
  }
  const glm::dvec3 by_translation = slope - nhat_W;
  at.gradient = spatial::to_vector6(spatial::Twist{glm::cross(at.p_ToC_W, by_translation) + couple, by_translation});
  return at;
}

void Tangent::go_along(const spatial::Pose& way_W) noexcept {
  p_WC_W = spatial::transform_point(way_W, p_WC_W);
  X0_WT = way_W * X0_WT;
  for (glm::dvec3* v : {&nhat_W, &slope_W, &couple_W}) *v = spatial::rotate(way_W, *v);
}

}  // namespace farfeel::local_model
