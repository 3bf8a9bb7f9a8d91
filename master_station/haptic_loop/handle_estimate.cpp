#include "master_station/haptic_loop/handle_estimate.h"

#include <cmath>

namespace farfeel::master_station {
namespace {

/// Longer than what chatters (some 3 ms), shorter than what a hand holds still.
constexpr double kCentred_s = 0.03;

/// What is left of being off the reading.
glm::dvec3 off_reading(const glm::dvec3& off, double step, double kept) {
  return glm::clamp(kept * off, glm::dvec3(-0.5 * step), glm::dvec3(0.5 * step));
}

}  // namespace

const spatial::Pose& HandleEstimate::next(const spatial::Pose& X_BD_read, double dt_s) noexcept {
  if (!is_known_) X_BD_ = X_BD_read;
  is_known_ = true;
  const double kept = std::exp(-dt_s / kCentred_s);
  const glm::dvec3 turned = spatial::vector_from_rotation(X_BD_.R * glm::conjugate(X_BD_read.R));
  X_BD_.R = glm::normalize(spatial::rotation_from_vector(off_reading(turned, step_rad_, kept)) * X_BD_read.R);
  X_BD_.p = X_BD_read.p + off_reading(X_BD_.p - X_BD_read.p, step_m_, kept);
  return X_BD_;
}

}  // namespace farfeel::master_station
