// By axis, with e how far the estimate is off the reading, s the step, and v the estimate's velocity:
//   e <- (e + v dt) exp(-dt / tau_c);  c = e within s / 2;  e' = c, and of the rest what exp(-dt / tau_b) leaves, s / 2
//   at most;  v <- v exp(-dt / tau_v) + beta (e' - e) / dt
// Between counts a handle that moves goes on: one that waited at the last border for the next would lag by half a step
// on the way out and on the way back, which is energy for the hand. What is slower than a step in tau_v waits.
#include "master_station/haptic_loop/handle_estimate.h"

#include <cmath>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::master_station {
namespace {

constexpr double kCentred_s = 0.03;  // tau_c; longer than what chatters (some 3 ms), or it would again
constexpr double kStill_s = 0.01;    // tau_v
/// tau_b. A handle that turns back inside a step is found a whole one further at the next count: at 5 kHz, on a spring
/// that is four times as stiff, a click of 0.16 N. Some two thirds of it at once are 0.1 N; at 1 kHz nothing is spread.
constexpr double kSpread_s = 0.2e-3;
constexpr double kLearned = 0.1;  // beta; 0.2, for rotations too: a stiff wall ripples at 4 kHz

/// How far it is off the reading now; its velocity changes with it.
glm::dvec3 off_reading(const glm::dvec3& before, glm::dvec3& velocity, double step, double dt_s) {
  const glm::dvec3 off = std::exp(-dt_s / kCentred_s) * (before + dt_s * velocity);
  const glm::dvec3 half(0.5 * step), within = glm::clamp(off, -half, half);
  const glm::dvec3 next = within + glm::clamp(std::exp(-dt_s / kSpread_s) * (off - within), -half, half);
  velocity = std::exp(-dt_s / kStill_s) * velocity + kLearned / dt_s * (next - off);
  return next;
}

}  // namespace

const spatial::Pose& HandleEstimate::next(const spatial::Pose& X_BD_read, double dt_s) noexcept {
  if (!is_known_) X_BD_ = X_BD_read, v_BD_m_s_ = {};
  is_known_ = true;
  if (ablated(Mechanism::kHandleEstimate)) return X_BD_ = X_BD_read;
  const glm::dvec3 turned = spatial::vector_from_rotation(X_BD_.R * glm::conjugate(X_BD_read.R));
  glm::dvec3 still{0};  // rotations wait at the border: see kLearned
  const glm::dvec3 turn = off_reading(turned, still, step_rad_, dt_s);
  X_BD_.R = glm::normalize(spatial::rotation_from_vector(turn) * X_BD_read.R);
  X_BD_.p = X_BD_read.p + off_reading(X_BD_.p - X_BD_read.p, v_BD_m_s_, step_m_, dt_s);
  return X_BD_;
}

}  // namespace farfeel::master_station
