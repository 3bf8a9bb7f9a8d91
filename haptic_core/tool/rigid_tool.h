// The simulated tool: one rigid body, moved by an implicit step that stays calm however light the body is.
//
// Linearised once: with W the sum of all wrenches on the tool about To,
//   (M - s h W_V - s^2 h^2 W_X) dV = h (W + s h W_X V),    X <- X moved for h with V + s dV,
// s = 1 is backward Euler (Otaduy & Lin, World Haptics 2005), which damps every oscillation; s = 1/2 is the midpoint
// rule, which keeps the energy of linear springs exactly and only loses what dampers take. A wrench that is to be the
// step's mean W + W_M way, with the way h (V + s dV), adds W_M / s to W_X. With W_M half a spring's W_X, that spring
// gets exactly the work that it stores, and under s = 1 the body loses m |dV|^2 / 2 alone. The symmetric parts of -W_X
// - W_M / s and -W_V are projected to positive semidefinite first, so that no direction is pushed away from rest by its
// own linearisation, and the gyroscopic torque is part of W.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/linear_response.h"

namespace farfeel::tool {

/// Of the body that is simulated, which may be lighter than the real one.
struct MassProperties {
  double mass_kg = 0.02;                                                          ///< > 0
  Eigen::Matrix3d inertia_To_T = Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal();  ///< symmetric, positive [kg m^2]
};

/// The same shape with another mass: inertia grows in proportion.
[[nodiscard]] MassProperties with_mass(const MassProperties&, double mass_kg);

struct RigidTool {
  MassProperties body;
  spatial::Pose X_WT;  ///< T's origin is the centre of mass
  spatial::Twist V_WT_W;
};

enum class Integrator : std::uint8_t { kBackwardEuler, kMidpoint };

/// What one step did.
struct StepWork {
  spatial::Vector6 V_moved;   ///< the twist the tool moved with during the step
  spatial::Vector6 V_change;  ///< its twist after the step less the one before
  double share;               ///< s
  double kinetic_J;           ///< after the step
};

[[nodiscard]] double kinetic_energy_J(const RigidTool&) noexcept;

/// A step before it is taken: A dV = impulse. A further wrench F that is held for the step adds dt_s F to the impulse,
/// so it changes the twist that the tool moves with by share dt_s A^-1 F. A need not be symmetric: the coupling's
/// tangent at an arm and the gyroscopic torque are not.
struct LinearStep {
  spatial::Matrix6 A;        ///< [kg m^2, kg m, kg], angular before linear
  spatial::Vector6 impulse;  ///< dt_s (W + share dt_s W_X V) [Nms, Ns]
  spatial::Vector6 V_begun;  ///< the twist at the step's beginning
  double share;              ///< s
  double dt_s;
};

/// The step that step() takes, not taken. Realtime-safe; cannot fail.
[[nodiscard]] LinearStep linear_step(const RigidTool&, const LinearResponse& forces, double dt_s,
                                     Integrator integrator = Integrator::kBackwardEuler) noexcept;
/// Moves the tool by a step whose twist changes by V_change. Realtime-safe; cannot fail.
StepWork take(RigidTool&, const LinearStep&, const spatial::Vector6& V_change) noexcept;

/// Moves the tool for dt_s > 0 under `forces` (without the gyroscopic torque, which is added here).
/// Realtime-safe. Not finite forces give a not finite tool: check before.
StepWork step(RigidTool& tool, const LinearResponse& forces, double dt_s,
              Integrator integrator = Integrator::kBackwardEuler) noexcept;

/// The wrench that `forces` exerted during a step, in the step's own linearisation: what times V_moved dt is its work.
[[nodiscard]] spatial::Vector6 applied_wrench(const LinearResponse& forces, const StepWork&, double dt_s) noexcept;

/// Nearest symmetric positive semidefinite matrix to `matrix`'s symmetric part in a metric where rotations are
/// lengths at `arm_m`, plus its skew part. Realtime-safe.
[[nodiscard]] spatial::Matrix6 with_positive_symmetric_part(const spatial::Matrix6& matrix, double arm_m) noexcept;

}  // namespace farfeel::tool
