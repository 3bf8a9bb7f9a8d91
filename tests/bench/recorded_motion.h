// Tool motions for benchmarks: strokes over a surface with reversals, pressing and lifting, made from a seed.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::bench {

/// Where and how a tool moves over a scene object, in S's frame. The tool comes from above: along -z.
struct MotionPlan {
  glm::dvec3 region_low_m, region_high_m;  ///< of the tool's origin; z: where to start looking for the surface
  spatial::Pose X_ST_rest;                 ///< the tool's middle orientation; its p is unused
  double turn_rad = 0.3;                   ///< about z, either way
  double tilt_rad = 0.05;                  ///< about x and y, either way
  double depth_low_m = -0.0002, depth_high_m = 0.001;  ///< of the deepest pair of pieces; negative is lifted
};

/// Poses X_ST at 1 kHz. Strokes are of minimum jerk at mean speeds of 10 to 160 mm/s (peaks to 300); every third turns
/// back on itself. The height follows the deepest pair of pieces at up to 0.2 m/s, as a light hand would.
[[nodiscard]] std::vector<spatial::Pose> recorded_motion(const collision::HullTree& S, const collision::HullTree& T,
                                                         double tolerance_m, const MotionPlan&, std::uint64_t seed,
                                                         std::size_t frames);

/// The same, pressed harder or less hard (all depths scaled by one factor, 0.25 to 6) until on average `pairs` pairs
/// are near.
[[nodiscard]] std::vector<spatial::Pose> recorded_motion_with_pairs(const collision::HullTree& S,
                                                                    const collision::HullTree& T, double tolerance_m,
                                                                    const MotionPlan& plan, std::uint64_t seed,
                                                                    std::size_t frames, double pairs);

}  // namespace farfeel::bench
