// Depth that the tool did not make by moving: an update, a tile that came, walls that oppose each other. It is recess
// from the row's birth, before any solve: the force does not know it, the proxy is on the new surface all the same.
// Then it is let in, at most so many newtons a tick, and paid for with what it stores in the pad. SI units.
// Realtime-safe; cannot fail.
#pragma once

#include "haptic_core/constraint/row.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::constraint {

/// The proxy was left on the surface, X_WP; what a row says to be deep there nobody moved into. made_m, >= 0: what one
/// look at a curved surface is off by, which is texture and no recess. Without a row's new depth: 0.
[[nodiscard]] double unmade_depth_m(const Row&, const spatial::Pose& X_WQ, const spatial::Pose& X_WP,
                                    double made_m) noexcept;

struct LetIn {
  double recess_m = 0;  ///< what is let in, 0 to the row's recess
  double costs_J = 0;   ///< what the pad then stores more
};
/// How much of a row's recess a tick lets in. normal_N: what the row pushes with; most_N: what that may grow by;
/// budget_J: what the tank affords. dU = l dr + k dr^2 / 2, of this row alone: a pad that others press too stores less.
[[nodiscard]] LetIn to_let_in(const Row&, double normal_N, double most_N, double budget_J) noexcept;

}  // namespace farfeel::constraint
