// One contact as a spring and damper. Otaduy & Lin, IEEE T-RO 22(4), 2006.
// Frames: W world, S scene object, T tool with origin To at its centre of mass. SI units.
#pragma once

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// U = k depth^2 / 2 while the surfaces overlap, else 0 [J].
[[nodiscard]] double penalty_energy_J(const Contact&) noexcept;

/// F_To_W = -(k depth + damping) grad(depth) while the surfaces overlap, else zero: the wrench on T about To.
/// The damping term is b d(depth)/dt, but never more than k depth either way: the contact never pulls T towards S,
/// however fast they part, and its force is continuous at first touch. V_ST_W is the twist of T relative to S, taken
/// at To. Contacts add; order is irrelevant. Realtime-safe; cannot fail.
[[nodiscard]] spatial::Wrench penalty_wrench(const Contact&, const spatial::Twist& V_ST_W) noexcept;

/// -d F_To_W / d pose of T, without damping: k (g g^T + depth H), H the depth's second derivative in the gradient's
/// coordinates. Zero while apart.
[[nodiscard]] spatial::Matrix6 penalty_stiffness(const Contact&, const spatial::Matrix6& hessian_W) noexcept;

}  // namespace farfeel::contact
