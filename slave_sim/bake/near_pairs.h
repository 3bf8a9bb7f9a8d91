// What a felt surface costs the haptic loop, by counting and not by a clock: the same surface, the same figure.
#pragma once

#include <cstdint>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::slave_sim {

inline constexpr double kBallShare = 1.0 / 40;        ///< diameter of the ball, of the surface's diagonal
inline constexpr std::uint32_t kMostNearPairs = 120;  ///< what the loop carries: of contacts of that many

/// How many convex pieces are nearer than its own radius to a ball that touches the coarse surface: of places spread
/// evenly over its area 19 in 20 have no more.
[[nodiscard]] std::uint32_t near_pairs_p95(const geometry::HapticSurface&);

}  // namespace farfeel::slave_sim
