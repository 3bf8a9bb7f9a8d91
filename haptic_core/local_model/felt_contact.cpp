#include "haptic_core/local_model/felt_contact.h"

#include <algorithm>

namespace farfeel::local_model {

FeltContact felt_contact(const contact::Contact& contact, const spatial::Pose& X0_WT) noexcept {
  FeltContact felt;
  felt.at_X0 = contact;
  felt.X0_WT = X0_WT;
  felt.nhat_W = contact.nhat_ST_W;
  return felt;
}

FeltContact::Sample FeltContact::sample(const spatial::Pose& X_WT) const noexcept {
  const spatial::Twist gradient = spatial::twist_from(at_X0.gradient);  // the two halves, by name
  const glm::dvec3 n0 = at_X0.nhat_ST_W;
  const glm::dvec3 along = gradient.linear_m_s + n0;
  const glm::dvec3 G = along - glm::dot(along, n0) * n0;
  const glm::dvec3 couple = gradient.angular_rad_s - glm::cross(at_X0.p_WC_W - X0_WT.p, gradient.linear_m_s);

  const glm::dquat turn = glm::normalize(X_WT.R * glm::conjugate(X0_WT.R));
  const glm::dvec3 p_WC = at_X0.p_WC_W + offset_W;
  const glm::dvec3 p_ToC = turn * (p_WC - X0_WT.p);
  const glm::dvec3 m = X_WT.p + p_ToC - p_WC;
  const double m_n = glm::dot(m, nhat_W);
  const glm::dvec3 l = m - m_n * nhat_W;
  const double l_length = glm::length(l);
  const bool is_clamped = l_length > at_X0.lateral_range_m;
  const double s = is_clamped ? at_X0.lateral_range_m / l_length : 1;

  glm::dvec3 slope = s * G;
  if (is_clamped) slope -= glm::dot(slope, l) / (l_length * l_length) * l;  // along l nothing rises any more
  const glm::dvec3 by_translation = slope - nhat_W;
  const glm::dvec3 by_rotation = glm::cross(p_ToC, by_translation) + s * couple;

  Sample sample;
  sample.depth_m = at_X0.depth_m - m_n + s * (glm::dot(G, l) + glm::dot(couple, spatial::vector_from_rotation(turn)));
  sample.felt_m = std::max(0.0, sample.depth_m - recess_m);
  sample.gradient = spatial::to_vector6(spatial::Twist{by_rotation, by_translation});
  sample.p_ToC_W = p_ToC;
  return sample;
}

}  // namespace farfeel::local_model
