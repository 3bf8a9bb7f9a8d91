// The curvature of a contact's depth as its gradient is seen to turn from tick to tick.
//
// A contact's stiffness is k (g g^T + depth H). Where ridges lie in grooves, or flat faces rock, the contact point
// jumps from flank to flank and H is the jump of the gradient over the way: thousands of N/m that no derivative at
// either pose shows. A tool too light for them is thrown from flank to flank for ever, unless its step knows them.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

/// Positive semidefinite, in (rotation, translation) of T about To, in W: the update of Broyden, Fletcher, Goldfarb and
/// Shanno on factors, H = L L^T, so that no rounding makes it indefinite. Realtime-safe.
class SeenCurvature {
 public:
  /// The gradient turned by `turn` [m/rad; 1] while T went `way` [rad; m].
  void see(const spatial::Vector6& way, const spatial::Vector6& turn) noexcept;
  /// What it was seen at has turned in W.
  void turn(const glm::dquat& R) noexcept;
  /// Its stiffness under a force, F H, less what is held without: none where that is enough. A step that knows of no
  /// curvature takes the force at its beginning, which is the truth a tick late; what was seen is noisier.
  [[nodiscard]] spatial::Matrix6 beyond(double force_N, double held_N_per_m) const noexcept;
  /// Its greatest stiffness under a force, at most.
  [[nodiscard]] double whole_N_per_m(double force_N) const noexcept;
  [[nodiscard]] spatial::Matrix6 matrix() const noexcept { return L_ * L_.transpose(); }

 private:
  spatial::Matrix6 L_ = spatial::Matrix6::Zero();
};

}  // namespace farfeel::local_model
