// The proxy: a pose of the tool's rotation that stays on the surface while the tool sinks into the pad.
//
// p = x' + c sum T f, then
//   1. pushed out along the pad's directions:  p += sum n_j m_j, m >= 0 from d + g.(p - q) <= 0 with the matrix
//   n_i.n_j;
//   2. sideways, across that push, at most h |v| + 50 um from where it was: where the pad is deeper than an edge is
//      round, one tangent would throw it off along that, to hang in the air while the tool pushes. Walls that leave no
//      room: at most h |v|;
//   3. what is left, of 1 and 2, by the least translation: matrix g_i.g_j, of the gradients' translations.
// Walls that leave no room between them share what is left.
#pragma once

#include <span>

#include "haptic_core/constraint/bounded_solver.h"
#include "haptic_core/constraint/contact_forces.h"
#include "haptic_core/constraint/row.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::constraint {

/// What is nearer is on the surface: a hundredth of what anybody feels, and more than sharing and rounding leave.
inline constexpr double kOnSurface_m = 10e-9;

struct ProxyStep {
  spatial::Pose X_WQ;         ///< where the rows were looked up
  spatial::Pose X_WT;         ///< the tool's after the step
  glm::dvec3 p_WP_before{0};  ///< the proxy's before it
  double way_m = 0;           ///< h |v| of the tool
};

struct ProxyPose {
  spatial::Pose X_WP;
  double depth_m = 0;  ///< by the rows, not below 0: what rows that leave no room leave
};

/// Full depths count, with what is recess: the proxy is on a new surface at once. Where a row is saturated the proxy
/// does not move sideways. Bounded time, no allocation; realtime-safe; cannot fail.
[[nodiscard]] ProxyPose pushed_out(std::span<const Row> rows, const ContactForces&, const ProxyStep&) noexcept;

}  // namespace farfeel::constraint
