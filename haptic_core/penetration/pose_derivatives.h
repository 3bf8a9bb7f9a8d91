// How the overlap d(u, v) = z_S - z_T at a fixed point of C's plane changes as T moves.
#pragma once

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::penetration {

using Matrix62 = Eigen::Matrix<double, 6, 2>;

/// d overlap / d (rotation, translation) of T about To. p_ToQ_C runs from To to T's surface point over (u, v).
[[nodiscard]] spatial::Vector6 overlap_gradient(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept;
/// Its derivative along u and v.
[[nodiscard]] Matrix62 overlap_gradient_slopes(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept;
/// d^2 overlap / d (rotation, translation)^2; the rotation exp(theta) acts from the left.
[[nodiscard]] spatial::Matrix6 overlap_hessian(const HeightAlong& t, const glm::dvec3& p_ToQ_C) noexcept;
/// d distance / d (rotation, translation): the distance from a fixed point of C's plane to T's edge.
[[nodiscard]] spatial::Vector6 edge_distance_gradient(const EdgeFade& fade, const glm::dvec3& p_ToFoot_C) noexcept;

}  // namespace farfeel::penetration
