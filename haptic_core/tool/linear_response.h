// A wrench on the tool, and how it changes when the tool moves: what the implicit step needs to know of a force.
#pragma once

#include "haptic_core/spatial/spatial.h"

namespace farfeel::tool {

/// About the tool's origin To, in W. Responses add.
struct LinearResponse {
  spatial::Vector6 F_To_W = spatial::Vector6::Zero();  ///< torque [Nm], then force [N]
  /// d F / d (rotation [rad] about To on the left, R <- exp(dtheta) R; translation [m]).
  spatial::Matrix6 by_pose = spatial::Matrix6::Zero();
  /// d F / d (angular [rad/s], linear [m/s] velocity).
  spatial::Matrix6 by_twist = spatial::Matrix6::Zero();

  LinearResponse& operator+=(const LinearResponse& other) noexcept {
    F_To_W += other.F_To_W;
    by_pose += other.by_pose;
    by_twist += other.by_twist;
    return *this;
  }
};

}  // namespace farfeel::tool
