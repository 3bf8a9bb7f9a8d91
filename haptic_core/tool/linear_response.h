// A wrench on the tool, and how it changes when the tool moves: what the implicit step needs to know of a force.
#pragma once

#include "haptic_core/spatial/spatial.h"

namespace farfeel::tool {

/// About the tool's origin To, in W. Responses add.
struct LinearResponse {
  spatial::Vector6 F_To_W = spatial::Vector6::Zero();  ///< torque [Nm], then force [N]
  /// d F / d (rotation [rad] about To on the left, R <- exp(dtheta) R; translation [m]).
  spatial::Matrix6 by_pose = spatial::Matrix6::Zero();
  /// The same of what is to be the mean of a step, not its end or middle: d mean / d way, the tool's within the step.
  /// Half of d F / d pose for a spring, which thus gets from the step's way exactly what it stores.
  spatial::Matrix6 mean_by_way = spatial::Matrix6::Zero();
  /// d F / d (angular [rad/s], linear [m/s] velocity).
  spatial::Matrix6 by_twist = spatial::Matrix6::Zero();

  LinearResponse& operator+=(const LinearResponse& other) noexcept {
    F_To_W += other.F_To_W;
    by_pose += other.by_pose;
    mean_by_way += other.mean_by_way;
    by_twist += other.by_twist;
    return *this;
  }
};

}  // namespace farfeel::tool
