// How far a device that tells a pose has moved since the last tick.
#pragma once

#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

/// A motion in the axes of the device's base; D's origin moves, the rest turns about it.
struct Motion {
  glm::dvec3 turned_rad{0, 0, 0};  ///< rotation vector
  glm::dvec3 moved_m{0, 0, 0};
  spatial::Twist V;  ///< as the driver estimates it
};

/// Motions add up to where the device is, whoever joins or leaves in between: what is not known to be one motion, such
/// as from before a new plugging in to after it, is no motion. Realtime-safe.
class Follower {
 public:
  /// Since the last call. can_be_used: the sample is heard and finite; else nothing moved, and the next starts anew.
  [[nodiscard]] Motion advance(const Sample&, bool can_be_used) noexcept;

  /// A hand turns by 0.03 rad in a tick of 1 ms at most. What turns further than this between two ticks was misread.
  static constexpr double kMostTurn_rad = 0.5;

 private:
  bool is_known_ = false;
  std::uint32_t opening_ = 0;
  spatial::Pose X_BD_;
};

}  // namespace farfeel::devices
