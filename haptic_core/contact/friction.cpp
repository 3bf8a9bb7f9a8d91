#include "haptic_core/contact/friction.h"

#include <algorithm>

namespace farfeel::contact {
namespace {

/// A slide has ended once the spring pulls this much less than it did: rounding must not make it stick at every step.
constexpr double kCaught = 0.9;

}  // namespace

FrictionLimits friction_limits(const Material& material, double normal_N, double share) noexcept {
  const double dynamic_N = material.dynamic_friction * normal_N;
  return {.stiffness_N_per_m = kTangentialShare * share * material.stiffness_N_per_m,
          .static_N = std::max(material.static_friction * normal_N, dynamic_N),
          .dynamic_N = dynamic_N};
}

double friction_energy_J(const Friction& friction, const FrictionLimits& limits) noexcept {
  return 0.5 * limits.stiffness_N_per_m * glm::dot(friction.stretch_W, friction.stretch_W);
}

FrictionForce friction_force(const Friction& friction, const FrictionLimits& limits, const glm::dvec3& v_slide_W,
                             double dt_s) noexcept {
  const double k = limits.stiffness_N_per_m;
  if (!(k > 0) || !(limits.static_N > 0)) return {};
  const glm::dvec3 coming_W = dt_s * v_slide_W;
  const glm::dvec3 trial_W = friction.stretch_W + coming_W;
  const double trial_N = k * glm::length(trial_W);
  if (trial_N <= (friction.is_sliding ? limits.dynamic_N : limits.static_N)) return {-k * friction.stretch_W, k, 0};
  // The spring at the step's end is as long as the surface can hold; what is given here is its beginning.
  const double coming_N = k * glm::length(coming_W);
  if (coming_N <= limits.dynamic_N) {
    const glm::dvec3 relaxed_W = limits.dynamic_N / trial_N * trial_W - coming_W;
    return {-k * relaxed_W, k, 0};
  }
  const double drag = limits.dynamic_N / glm::length(v_slide_W);
  return {-drag * v_slide_W, 0, drag};
}

void slide(Friction& friction, const FrictionLimits& limits, const glm::dvec3& moved_W) noexcept {
  friction.stretch_W += moved_W;
  const double held_N = limits.stiffness_N_per_m * glm::length(friction.stretch_W);
  if (held_N > (friction.is_sliding ? limits.dynamic_N : limits.static_N)) {
    friction.is_sliding = true;
    friction.stretch_W *= limits.dynamic_N / held_N;
  } else if (held_N < kCaught * limits.dynamic_N) {
    friction.is_sliding = false;
  }
}

void turn_to(Friction& friction, const glm::dvec3& nhat_W) noexcept {
  friction.stretch_W -= glm::dot(friction.stretch_W, nhat_W) * nhat_W;
}

}  // namespace farfeel::contact
