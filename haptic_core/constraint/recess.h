// Depth that the tool did not make by moving, where walls that oppose each other leave no room. It is recess before any
// solve: the force does not know it, the proxy is on the new surface all the same. SI units. Realtime-safe; cannot
// fail.
#pragma once

#include "haptic_core/constraint/row.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::constraint {

/// The proxy was left on the surface, X_WP; what a row says to be deep there nobody moved into. made_m, >= 0: what one
/// look at a curved surface is off by, which is texture and no recess. Without a row's new depth: 0.
[[nodiscard]] double unmade_depth_m(const Row&, const spatial::Pose& X_WQ, const spatial::Pose& X_WP,
                                    double made_m) noexcept;

}  // namespace farfeel::constraint
