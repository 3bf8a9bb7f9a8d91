#include "haptic_core/contact/penalty.h"

#include <algorithm>

namespace farfeel::contact {

double penalty_energy_J(const Contact& contact) noexcept {
  const double depth_m = std::max(contact.depth_m, 0.0);
  return 0.5 * contact.material.stiffness_N_per_m * depth_m * depth_m;
}

spatial::Wrench penalty_wrench(const Contact& contact, const spatial::Twist& V_ST_W) noexcept {
  if (!(contact.depth_m > 0)) return {};
  const double spring_N = contact.material.stiffness_N_per_m * contact.depth_m;
  const double depth_rate_m_s = contact.gradient.dot(spatial::to_vector6(V_ST_W));
  const double damper_N = std::clamp(contact.material.damping_Ns_per_m * depth_rate_m_s, -spring_N, spring_N);
  return spatial::wrench_from(-(spring_N + damper_N) * contact.gradient);
}

spatial::Matrix6 penalty_stiffness(const Contact& contact, const spatial::Matrix6& hessian_W) noexcept {
  if (!(contact.depth_m > 0)) return spatial::Matrix6::Zero();
  return contact.material.stiffness_N_per_m *
         (contact.gradient * contact.gradient.transpose() + contact.depth_m * hessian_W);
}

}  // namespace farfeel::contact
