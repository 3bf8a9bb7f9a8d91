// What a step of the tool does without contacts, and how a further wrench changes that.
#pragma once

#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::constraint {

/// Both of the twist that the tool moves with.
struct Mobility {
  spatial::Vector6 V_begun;    ///< before the step [rad/s, m/s]
  spatial::Vector6 V_free;     ///< U: without any row [rad/s, m/s]
  spatial::Matrix6 by_wrench;  ///< C = share dt A^-1, about To, in W
  double dt_s = 0;
};
[[nodiscard]] Mobility mobility(const tool::LinearStep&) noexcept;

/// From one pose to another: rotation vector, then translation, both in W.
[[nodiscard]] spatial::Vector6 way_between(const spatial::Pose& from, const spatial::Pose& to) noexcept;

}  // namespace farfeel::constraint
