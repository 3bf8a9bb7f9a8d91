// Tool motions for benchmarks: strokes over a surface with reversals, pressing and lifting, made from a seed.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/contact/tracking/crossed_sheets.h"
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

/// What a motion is made over. The surfaces may go after construction; it must keep its place.
struct MotionBodies {
  MotionBodies(const geometry::HapticSurface& felt_s, const geometry::HapticSurface& felt_t);
  MotionBodies(const MotionBodies&) = delete;
  MotionBodies& operator=(const MotionBodies&) = delete;

  collision::HullTree S, T;
  contact::CrossedSheets crossed;
};

/// Poses X_ST at 1 kHz. Strokes are of minimum jerk at mean speeds of 10 to 160 mm/s (peaks to 300); every third turns
/// back on itself. The height follows the deepest pair of pieces at up to 0.2 m/s, as a light hand would: sheets that
/// were pressed through each other count on, or the hand would fall through every thin wall that it presses.
[[nodiscard]] std::vector<spatial::Pose> recorded_motion(MotionBodies&, double tolerance_m, const MotionPlan&,
                                                         std::uint64_t seed, std::size_t frames);

/// What a motion is like, at a tolerance.
struct MotionCharacter {
  double pairs_mean = 0, pairs_deviation = 0;  ///< pairs of pieces nearer than the tolerance: mean, standard deviation
  double contact_share = 0;                    ///< of frames in which pieces that face each other overlap
  double contacts_mean = 0;                    ///< clusters, over those frames
  double fastest_m_per_s = 0, median_m_per_s = 0;  ///< of the tool's origin
};
[[nodiscard]] MotionCharacter character_of(const collision::HullTree& S, const collision::HullTree& T,
                                           double tolerance_m, const std::vector<spatial::Pose>& motion);

/// What is asked of a motion.
struct MotionWanted {
  double pairs, pairs_within;  ///< on average, and how far from it at most; the less they vary the better
  double contacts;             ///< on average, at least
  double contact_share;        ///< at least
};

/// Of many recorded motions, at places and turns of the tool drawn from the seed, the one that is as wanted and whose
/// pairs vary least; if none is, the nearest. The plan's region says how far strokes reach from such a place.
[[nodiscard]] std::vector<spatial::Pose> recorded_motion_like(MotionBodies&, double tolerance_m, const MotionPlan& plan,
                                                              std::uint64_t seed, std::size_t frames,
                                                              const MotionWanted& wanted);

}  // namespace farfeel::bench
