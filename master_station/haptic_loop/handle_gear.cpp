#include "master_station/haptic_loop/handle_gear.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::master_station {
namespace {

constexpr double kRelaxation_s = 0.1;

spatial::Pose moved(const spatial::Pose& X, const glm::dvec3& rotation, const glm::dvec3& translation) {
  return {glm::normalize(spatial::rotation_from_vector(rotation) * X.R), X.p + translation};
}

glm::dvec3 turn_to(const spatial::Pose& from, const spatial::Pose& to) {
  return spatial::vector_from_rotation(to.R * glm::conjugate(from.R));
}

/// As far from X towards X_goal as these allow.
spatial::Pose nearer(const spatial::Pose& X, const spatial::Pose& X_goal, double most_rad, double most_m) {
  return moved(X, spatial::no_longer_than(most_rad, turn_to(X, X_goal)),
               spatial::no_longer_than(most_m, X_goal.p - X.p));
}

}  // namespace

void HandleGear::start(const spatial::Pose& X_WD) noexcept {
  X_WD_ = X_WD;
  X_WI_ = {X_WD.R, scales_.workspace * X_WD.p};
  V_WI_W_ = {};
  engagement_ = 1;
}

void HandleGear::take_hold(const spatial::Pose& X_WD, const spatial::Pose& X_WI) noexcept {
  X_WD_ = X_WD;
  X_WI_ = X_WI;
  V_WI_W_ = {};
  engagement_ = 0;
}

void HandleGear::advance(const spatial::Pose& X_WD, const spatial::Twist& V_WD_W, bool is_clutch_held, double dt_s,
                         bool is_off) noexcept {
  const bool lets_go = is_off || (is_clutch_held && scales_.has_clutch);
  const double step = dt_s / kClutch_s;
  engagement_ = std::clamp(engagement_ + (lets_go ? -step : step), 0.0, 1.0);
  const glm::dvec3 turned = turn_to(X_WD_, X_WD);
  X_WI_ = moved(X_WI_, engagement_ * turned, engagement_ * scales_.workspace * (X_WD.p - X_WD_.p));
  V_WI_W_ = {engagement_ * V_WD_W.angular_rad_s, engagement_ * scales_.workspace * V_WD_W.linear_m_s};
  X_WD_ = X_WD;
}

void HandleGear::relax_towards(const spatial::Pose& X_WI_rest, double dt_s) noexcept {
  if (engagement_ > 0) return;
  const double share = -std::expm1(-dt_s / kRelaxation_s);
  X_WI_ = moved(X_WI_, share * turn_to(X_WI_, X_WI_rest), share * (X_WI_rest.p - X_WI_.p));
}

bool HandleGear::lead_to(const spatial::Pose& X_WI_goal, const spatial::Pose& X_WI_rest, double dt_s) noexcept {
  constexpr double kThere_m = 1e-6, kThere_rad = 1e-4;
  if (engagement_ > 0) return false;
  X_WI_ = nearer(X_WI_rest, nearer(X_WI_, X_WI_goal, kLead_rad_s * dt_s, kLead_m_s * dt_s), kAhead_rad, kAhead_m);
  return glm::length(X_WI_goal.p - X_WI_.p) < kThere_m && glm::length(turn_to(X_WI_, X_WI_goal)) < kThere_rad;
}

spatial::Wrench HandleGear::on_hand(const spatial::Wrench& F_I_W) const noexcept {
  return {engagement_ * scales_.torque() * F_I_W.torque_Nm, engagement_ * scales_.force * F_I_W.force_N};
}

}  // namespace farfeel::master_station
