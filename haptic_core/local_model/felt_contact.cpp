#include "haptic_core/local_model/felt_contact.h"

#include <algorithm>

namespace farfeel::local_model {
namespace {

glm::dvec3 clamped(const glm::dvec3& v, double most) {
  const double length = glm::length(v);
  return length > most ? most / length * v : v;
}

}  // namespace

FeltContact felt_contact(const contact::Contact& contact, const spatial::Pose& X0_WT) noexcept {
  const spatial::Twist gradient = spatial::twist_from(contact.gradient);  // the two halves, by name
  const glm::dvec3 n = contact.nhat_ST_W;
  const glm::dvec3 along = gradient.linear_m_s + n;
  const glm::dvec3 arm_part = glm::cross(contact.p_WC_W - X0_WT.p, gradient.linear_m_s);
  FeltContact felt;
  felt.at_X0 = contact;
  felt.X0_WT = X0_WT;
  felt.nhat_W = n;
  const glm::dvec3 slope = along - glm::dot(along, n) * n;
  felt.slope_W = felt.slope_goal_W = clamped(slope, kMaxSlope);
  // A couple is a difference of arms times slopes: beside a wall it is nothing but rounding.
  if (glm::length(slope) <= kMaxSlope) felt.couple_W = clamped(gradient.angular_rad_s - arm_part, kMaxCouple_m);
  return felt;
}

FeltContact::Sample FeltContact::sample(const spatial::Pose& X_WT) const noexcept {
  const glm::dquat turn = glm::normalize(X_WT.R * glm::conjugate(X0_WT.R));
  const glm::dvec3 p_WC = at_X0.p_WC_W + offset_W;
  const glm::dvec3 p_ToC = turn * (p_WC - X0_WT.p);
  const glm::dvec3 m = X_WT.p + p_ToC - p_WC;
  const double m_n = glm::dot(m, nhat_W);
  const glm::dvec3 l = m - m_n * nhat_W;
  const double l_length = glm::length(l);
  const bool is_clamped = l_length > at_X0.lateral_range_m;
  const double s = is_clamped ? at_X0.lateral_range_m / l_length : 1;

  glm::dvec3 slope = s * slope_W;
  if (is_clamped) slope -= glm::dot(slope, l) / (l_length * l_length) * l;  // along l nothing rises any more
  const glm::dvec3 by_translation = slope - nhat_W;
  const glm::dvec3 by_rotation = glm::cross(p_ToC, by_translation) + s * couple_W;

  Sample sample;
  sample.depth_m =
      at_X0.depth_m - m_n + s * (glm::dot(slope_W, l) + glm::dot(couple_W, spatial::vector_from_rotation(turn)));
  sample.felt_m = std::max(0.0, sample.depth_m - recess_m);
  sample.gradient = spatial::to_vector6(spatial::Twist{by_rotation, by_translation});
  sample.p_ToC_W = p_ToC;
  return sample;
}

}  // namespace farfeel::local_model
