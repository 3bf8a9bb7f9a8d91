// Friction of one contact with stick and slip: a spring across the contact direction that holds up to the static limit
// and is dragged along at the dynamic one.
//
// Hayward & Armstrong, Experimental Robotics VI, 2000, for the state: a displacement, so that a tool at rest under a
// sideways load does not creep, whatever the noise. Made for an implicit step: what evaluates it gets a tangent that
// never lets the step's end push along with the motion. Frames: W world, C the contact, T tool. SI units.
// Every call is realtime-safe and cannot fail.
#pragma once

#include <glm/glm.hpp>

#include "haptic_core/contact/material.h"

namespace farfeel::contact {

/// Tangential over normal stiffness of two elastic bodies pressed together, 2 (1 - nu) / (2 - nu) at nu = 0.3.
/// Mindlin, J. Applied Mechanics 16, 1949.
inline constexpr double kTangentialShare = 0.82;

/// What the surface can hold just now.
struct FrictionLimits {
  double stiffness_N_per_m;    ///< of the tangential spring, >= 0
  double static_N, dynamic_N;  ///< largest force at rest and in motion, static_N >= dynamic_N >= 0
};
/// normal_N >= 0: what the contact pushes with. share scales the stiffness: 1, or less while a contact is let go.
[[nodiscard]] FrictionLimits friction_limits(const Material&, double normal_N, double share = 1) noexcept;

/// The state. A new contact starts with none.
struct Friction {
  glm::dvec3 stretch_W{0};  ///< of the spring, from the point where it would be at rest to C; across the direction [m]
  bool is_sliding = false;
};

/// Stored in the spring [J].
[[nodiscard]] double friction_energy_J(const Friction&, const FrictionLimits&) noexcept;

/// Force on the tool at C, and how it falls when C moves across the direction; both tangents are isotropic there.
struct FrictionForce {
  glm::dvec3 force_W{0};
  double by_displacement_N_per_m = 0;
  double by_velocity_Ns_per_m = 0;
};
/// v_slide_W: C's velocity across the direction as the step begins [m/s]. While the spring would be dragged along it is
/// first relaxed by as much as this motion stretches it, which only ever gives energy away. Where one step moves
/// further than the spring can stretch it acts as a damper of the same force.
[[nodiscard]] FrictionForce friction_force(const Friction&, const FrictionLimits&, const glm::dvec3& v_slide_W,
                                           double dt_s) noexcept;

/// C has moved across the direction: stretches the spring, or drags it along. Limits are those at the motion's end.
void slide(Friction&, const FrictionLimits&, const glm::dvec3& moved_W) noexcept;

/// The direction has turned: the stretch stays across it and loses what pointed along.
void turn_to(Friction&, const glm::dvec3& nhat_W) noexcept;

}  // namespace farfeel::contact
