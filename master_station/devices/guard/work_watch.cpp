#include "master_station/devices/guard/work_watch.h"

#include <algorithm>

namespace farfeel::devices {
namespace {

constexpr double kSoft_N_per_m = 50;  // softer is no surface; it may hold |F|^2 / 100
constexpr double kQuiet_N = 0.1;      // no touch
constexpr double kForgets_s = 0.02;   // after that long without, each touch counts for itself
constexpr double kForgiven_W = 5e-3;  // so that what updates may add within a long touch does not add up
constexpr double kPause_s = 5e-3;     // a shorter stop is still the same giving

}  // namespace

bool WorkWatch::next(const spatial::Wrench& F, const spatial::Pose& from, const spatial::Pose& to, double given_J,
                     double dt_s, double moving_J) noexcept {
  const glm::dvec3 turned = spatial::vector_from_rotation(to.R * glm::conjugate(from.R));
  const double on_hand_J = glm::dot(F.force_N, to.p - from.p) + glm::dot(F.torque_Nm, turned);
  const double force_N = glm::length(F.force_N);
  const double most_J = force_N * force_N / (2 * kSoft_N_per_m) + moving_J;
  if (is_anew_) energy_J_ = most_J;
  is_anew_ = false;
  energy_J_ = std::min(energy_J_ + given_J - on_hand_J, most_J);
  if (energy_J_ < 0) energy_J_ = std::min(0.0, energy_J_ + kForgiven_W * dt_s);
  quiet_s_ = force_N < kQuiet_N ? quiet_s_ + dt_s : 0;
  if (quiet_s_ > kForgets_s) energy_J_ = moving_J;
  least_J_ = std::min(least_J_, energy_J_);
  giving_s_ = energy_J_ < 0 ? giving_s_ + dt_s : std::max(0.0, giving_s_ - dt_s * kLong_s / kPause_s);
  return energy_J_ < -kAllowance_J && giving_s_ >= kLong_s;
}

}  // namespace farfeel::devices
