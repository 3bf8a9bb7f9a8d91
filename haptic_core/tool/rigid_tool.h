// The simulated tool: one rigid body, moved by an implicit step that stays calm however light the body is.
//
// Backward Euler, linearised once: with W the sum of all wrenches on the tool about To,
//   (M - h W_V - h^2 W_X) dV = h (W + h W_X V),    X <- X moved for h with V + dV.
// Otaduy & Lin, World Haptics 2005. The symmetric parts of -W_X and -W_V are projected to positive semidefinite first,
// so that no direction is pushed away from rest by its own linearisation, and the gyroscopic torque is part of W.
#pragma once

#include <Eigen/Core>

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

/// What one step did.
struct StepWork {
  spatial::Vector6 V_WT_W;  ///< the twist the tool moved with during the step
  double kinetic_J;         ///< after the step
};

[[nodiscard]] double kinetic_energy_J(const RigidTool&) noexcept;

/// Moves the tool for dt_s > 0 under `forces` (without the gyroscopic torque, which is added here).
/// Realtime-safe. Not finite forces give a not finite tool: check before.
StepWork step(RigidTool& tool, const LinearResponse& forces, double dt_s) noexcept;

/// The wrench that `forces` exerted during a step, in the step's own linearisation: W + h W_X (V + dV) + W_V dV.
[[nodiscard]] spatial::Vector6 applied_wrench(const LinearResponse& forces, const spatial::Vector6& V_before,
                                              const spatial::Vector6& V_after, double dt_s) noexcept;

/// Nearest symmetric positive semidefinite matrix to `matrix`'s symmetric part in a metric where rotations are
/// lengths at `arm_m`, plus its skew part. Realtime-safe.
[[nodiscard]] spatial::Matrix6 with_positive_symmetric_part(const spatial::Matrix6& matrix, double arm_m) noexcept;

}  // namespace farfeel::tool
