#include "master_station/devices/hand/follower.h"

namespace farfeel::devices {

Motion Follower::advance(const Sample& sample, bool can_be_used) noexcept {
  Motion motion;
  if (can_be_used && is_known_ && sample.opening == opening_) {
    motion = {spatial::vector_from_rotation(sample.X_BD.R * glm::conjugate(X_BD_.R)), sample.X_BD.p - X_BD_.p,
              sample.V_BD_B};
    if (!(glm::length(motion.turned_rad) <= kMostTurn_rad)) motion.turned_rad = motion.V.angular_rad_s = glm::dvec3(0);
  }
  is_known_ = can_be_used;
  opening_ = sample.opening;
  if (can_be_used) X_BD_ = sample.X_BD;
  return motion;
}

}  // namespace farfeel::devices
