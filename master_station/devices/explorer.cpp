// The person: strokes of least jerk (Flash & Hogan 1985), felt forces that are answered after 40 ms, within what the
// fastest stretch reflex takes (20-50 ms; the next ones 50-100 ms: Pruszynski & Scott, Exp. Brain Res. 218, 2012), and
// a force that is held by an integrator of a few hertz, slow enough not to ring over that delay.
#include "master_station/devices/explorer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::master_station {
namespace {

constexpr double kClearance_m = 0.012;  // between strokes the tool is lifted so far
constexpr double kDescent_m_s = 0.06;   // until something is felt
constexpr double kFirstTouch_N = 0.3;   // that is felt
constexpr double kRegulation_Hz = 3.5;  // bandwidth of a hand that holds a force
constexpr double kMaxRegulation_m_s = 0.08;
constexpr double kSearchBelow_m = 0.02;           // under the region, before the hand gives up and lifts
constexpr double kSlowest = 0.1, kFastest = 3.0;  // peak speeds of strokes, as shares of the hinted speed
constexpr double kMaxStroke_s = 1.5;
constexpr double kMaxYaw_rad = 0.08, kMaxTwist_rad = 0.2;

/// Minimum-jerk progress from 0 to 1 (Flash & Hogan, J. Neurosci. 5(7), 1985); its peak rate is 1.875 / length.
double progress(double t, double length) {
  const double x = std::clamp(t / length, 0.0, 1.0);
  return x * x * x * (10 + x * (-15 + 6 * x));
}
constexpr double kPeakRate = 1.875;

glm::dquat turn_between(const glm::dvec3& from, const glm::dvec3& to) {
  const double cosine = glm::dot(from, to);
  if (cosine < -1 + 1e-9)
    return spatial::rotation_from_vector(std::numbers::pi * (spatial::frame_with_z(from) * glm::dvec3(1, 0, 0)));
  const glm::dvec3 axis = glm::cross(from, to);
  return glm::normalize(glm::dquat(1 + cosine, axis.x, axis.y, axis.z));
}

}  // namespace

double Explorer::most_press_N(const codecs::Exploration& hints, double stiffness_N_per_m) noexcept {
  const glm::dvec3 depth_W = hints.region_high_W - hints.region_low_W;
  return stiffness_N_per_m * (kSearchBelow_m + glm::dot(glm::abs(glm::normalize(hints.approach_W)), glm::abs(depth_W)));
}

Explorer::Explorer(const ExplorerSettings& settings) : settings_(settings), random_(settings.seed) {
  const codecs::Exploration& hints = settings_.hints;
  settings_.hints.approach_W = glm::normalize(hints.approach_W);
  settings_.hints.nhat_work_T = glm::normalize(hints.nhat_work_T);
  const glm::dvec3 half = 0.5 * glm::abs(hints.region_high_W - hints.region_low_W);
  centre_W_ = 0.5 * (hints.region_low_W + hints.region_high_W);
  const glm::dquat frame = spatial::frame_with_z(hints.approach_W);
  across_W_ = {frame * glm::dvec3(1, 0, 0), frame * glm::dvec3(0, 1, 0)};
  for (std::size_t i = 0; i < 2; ++i) half_extent_m_[i] = glm::dot(glm::abs(across_W_[i]), half);
  half_depth_m_ = glm::dot(glm::abs(hints.approach_W), half);
  R_WT_facing_ = turn_between(hints.nhat_work_T, hints.approach_W);
  at_ = to_ = any_place();
  advance_m_ = -half_depth_m_ - kClearance_m;
  yaw_rad_ = yaw_rest_rad_ = uniform(-kMaxYaw_rad, kMaxYaw_rad);
  enter(Phase::kApproach);
}

double Explorer::uniform(double low, double high) noexcept {
  // Not std::uniform_real_distribution: its result is not the same everywhere.
  return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
}

Explorer::Plane Explorer::any_place() noexcept {
  const double u = uniform(-1, 1) * half_extent_m_[0];
  return {u, uniform(-1, 1) * half_extent_m_[1]};
}

spatial::Pose Explorer::X_WHand() const noexcept {
  const glm::dvec3 approach = settings_.hints.approach_W;
  const glm::dquat R_WT = spatial::rotation_from_vector(yaw_rad_ * approach) * R_WT_facing_;
  const glm::dvec3 p_Work = centre_W_ + at_.u * across_W_[0] + at_.v * across_W_[1] + advance_m_ * approach;
  return spatial::Pose{R_WT, p_Work - R_WT * settings_.hints.p_TWork_T} * settings_.X_TG;
}

void Explorer::enter(Phase phase) noexcept {
  phase_ = phase;
  phase_s_ = 0;
  switch (phase) {
    case Phase::kApproach:
      break;  // ends when something is felt
    case Phase::kPress:
      phase_length_s_ = uniform(0.2, 0.5);
      break;
    case Phase::kStroke:
      phase_length_s_ = uniform(4, 7);
      begin_stroke();
      break;
    case Phase::kTwist:
      phase_length_s_ = uniform(0.8, 1.5);
      twist_rad_ = std::copysign(uniform(0.3, 1) * kMaxTwist_rad, uniform(-1, 1));
      break;
    case Phase::kLift:
      phase_length_s_ = 0.35;
      from_ = at_;
      to_ = any_place();
      break;
  }
}

void Explorer::begin_stroke() noexcept {
  from_ = at_;
  to_ = any_place();
  const double length_m = std::hypot(to_.u - from_.u, to_.v - from_.v);
  const double speed_m_s =
      settings_.hints.stroke_speed_m_per_s * kSlowest * std::pow(kFastest / kSlowest, uniform(0, 1));
  stroke_s_ = 0;
  stroke_length_s_ = std::max(0.05, kPeakRate * length_m / speed_m_s);
  if (stroke_length_s_ > kMaxStroke_s) {  // a slow stroke is a short one, not a long wait
    const double share = kMaxStroke_s / stroke_length_s_;
    to_ = {from_.u + share * (to_.u - from_.u), from_.v + share * (to_.v - from_.v)};
    stroke_length_s_ = kMaxStroke_s;
  }
}

/// The hand moves its intent into the surface until the wanted force is felt: an integrator on the force error.
void Explorer::regulate(double felt_N) noexcept {
  const double rate = 2 * std::numbers::pi * kRegulation_Hz / settings_.hand_stiffness_N_per_m;
  const double speed =
      std::clamp(rate * (settings_.hints.press_force_N - felt_N), -kMaxRegulation_m_s, kMaxRegulation_m_s);
  advance_m_ += speed * kStep_s;
}

void Explorer::advance(const spatial::Wrench& F_hand_W) noexcept {
  const spatial::Pose before = X_WHand();
  const double felt_N = felt_N_[felt_next_];
  felt_N_[felt_next_] = -glm::dot(F_hand_W.force_N, settings_.hints.approach_W);
  felt_next_ = (felt_next_ + 1) % kReactionSteps;

  phase_s_ += kStep_s;
  const bool is_over = phase_s_ >= phase_length_s_;
  switch (phase_) {
    case Phase::kApproach:
      advance_m_ += kDescent_m_s * kStep_s;
      if (felt_N > kFirstTouch_N) enter(Phase::kPress);
      break;
    case Phase::kPress:
      regulate(felt_N);
      if (is_over) enter(Phase::kStroke);
      break;
    case Phase::kStroke: {
      regulate(felt_N);
      stroke_s_ += kStep_s;
      const double x = progress(stroke_s_, stroke_length_s_);
      at_ = {from_.u + x * (to_.u - from_.u), from_.v + x * (to_.v - from_.v)};
      if (stroke_s_ < stroke_length_s_) break;
      if (is_over) {
        enter(Phase::kTwist);
      } else {
        begin_stroke();
      }
      break;
    }
    case Phase::kTwist: {
      regulate(felt_N);
      const double half = 0.5 * phase_length_s_;
      const double x = phase_s_ < half ? progress(phase_s_, half) : 1 - progress(phase_s_ - half, half);
      yaw_rad_ = yaw_rest_rad_ + x * twist_rad_;
      if (is_over) enter(Phase::kLift);
      break;
    }
    case Phase::kLift: {
      constexpr double kLift_m_s = 0.1;
      advance_m_ = std::max(advance_m_ - kLift_m_s * kStep_s, -half_depth_m_ - kClearance_m);
      const double x = progress(phase_s_, phase_length_s_);
      at_ = {from_.u + x * (to_.u - from_.u), from_.v + x * (to_.v - from_.v)};
      if (is_over) enter(Phase::kApproach);
      break;
    }
  }
  if (advance_m_ > half_depth_m_ + kSearchBelow_m) enter(Phase::kLift);

  const spatial::Pose after = X_WHand();
  V_WHand_W_ = {spatial::vector_from_rotation(after.R * glm::conjugate(before.R)) / kStep_s,
                (after.p - before.p) / kStep_s};
}

}  // namespace farfeel::master_station
