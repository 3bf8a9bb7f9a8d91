#include "haptic_core/local_model/contact_response.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {

using spatial::Matrix6;
using spatial::Vector6;

namespace {

/// Friction resists the tool's way across the direction, and what its object goes meanwhile.
void add_friction(Felt& felt, const FeltContact& contact, const FeltContact::Sample& at, const Vector6& V_WS_W,
                  const Step& step) {
  const glm::dvec3& nhat_W = contact.transition.nhat_W;
  const contact::FrictionLimits limits = contact.friction_limits(contact.felt_m(at));
  const glm::dvec3 v_surface = across(spatial::velocity_at(spatial::twist_from(V_WS_W), at.p_ToC_W), nhat_W);
  const glm::dvec3 v_slide =
      across(spatial::velocity_at(spatial::twist_from(step.V_WT_W), at.p_ToC_W), nhat_W) - v_surface;
  const contact::FrictionForce friction = contact::friction_force(contact.friction, limits, v_slide, step.dt_s);
  Eigen::Matrix<double, 3, 6> J;  // velocity of C across the direction, from the twist about To
  const Eigen::Vector3d n = spatial::to_eigen(nhat_W);
  const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - n * n.transpose();
  J << -P * spatial::cross_matrix(at.p_ToC_W), P;
  const Matrix6 JtJ = J.transpose() * J;
  felt.response.F_To_W +=
      J.transpose() * spatial::to_eigen(friction.force_W + friction.by_displacement_N_per_m * step.dt_s * v_surface);
  felt.response.by_pose -= friction.by_displacement_N_per_m * JtJ;
  felt.response.by_twist -= friction.by_velocity_Ns_per_m * JtJ;
  felt.energy_J += contact::friction_energy_J(contact.friction, limits);
}

}  // namespace

double held_without_N_per_m(double tool_mass_kg, double dt_s) noexcept {
  return kHeldOfMass * tool_mass_kg / (dt_s * dt_s);
}

double damping_Ns_per_m(const FeltContact& felt, double tool_mass_kg) noexcept {
  const double critical = 2 * std::sqrt(felt.stiffness_N_per_m() * tool_mass_kg);
  if (ablated(Mechanism::kDampedWhenOld)) return felt.damping_Ns_per_m();
  return felt.damping_Ns_per_m() + kDampedWhenOld * felt.received.origin.news_s / kSlowestNews_s * critical;
}

void add_response(Felt& felt, const FeltContact& contact, const FeltContact::Sample& at, const Vector6& V_WS_W,
                  const Step& step) noexcept {
  const Vector6& g = at.gradient;
  const double stiffness = contact.stiffness_N_per_m(), felt_m = contact.felt_m(at);
  const double rate_m_s = g.dot(step.V_WT_W - V_WS_W);
  const double surface_m = g.dot(V_WS_W) * step.dt_s;  // what its object takes off the depth within the step
  const double mean = contact.received.is_from_tiles() ? step.mean_share : 0;
  const auto push = [&](const Matrix6& spring) {
    felt.response.by_pose -= (1 - mean) * spring;
    felt.response.mean_by_way -= 0.5 * mean * spring;
  };
  if (felt_m <= 0) {
    // One that will touch within the step: its spring, written about the gap, pushes at the step's end with just the
    // depth it reaches, and as its mean with half of that. Left out, it would store energy that nobody put in.
    const double gap_m = at.depth_m - contact.transition.recess_m;
    if (gap_m + rate_m_s * step.dt_s > 0 && !ablated(Mechanism::kGapSprings)) {
      felt.response.F_To_W -= stiffness * (1 - 0.5 * mean) * (gap_m - surface_m) * g;
      push(stiffness * g * g.transpose());
    }
    return;
  }
  const double spring_N = stiffness * felt_m;
  // Never pulls, continuous at touch; and implicit however much is clamped: held for a step, what a debt asks for
  // would throw a light tool back and make more debt.
  const double damping = std::min(damping_Ns_per_m(contact, step.tool_mass_kg) + step.payback_Ns_per_m,
                                  spring_N / std::max(std::abs(rate_m_s), 1e-12));
  const double damper_N = std::clamp(damping * rate_m_s, -spring_N, spring_N);
  felt.response.F_To_W -= (spring_N - stiffness * (1 - 0.5 * mean) * surface_m + damper_N) * g;
  push(stiffness * g * g.transpose());
  // How the force turns with the way to its object.
  Matrix6 turning = contact.seen.beyond(spring_N, held_without_N_per_m(step.tool_mass_kg, step.dt_s));
  if (contact.received.is_bent() || !contact.kept.is_empty()) turning += spring_N * contact.bend_at(step.X_WT);
  felt.response.by_pose -= turning;
  felt.response.F_To_W += step.dt_s * (turning * V_WS_W);
  felt.response.by_twist -= damping * g * g.transpose();
  felt.energy_J += contact.energy_J(felt_m);
  felt.by_outline += contact.received.is_from_outline();
  felt.outline_off_m = std::max(felt.outline_off_m, contact.received.origin.off_m);
  add_friction(felt, contact, at, V_WS_W, step);
}

}  // namespace farfeel::local_model
