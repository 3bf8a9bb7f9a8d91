#include "master_station/devices/guard/axis_probe.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace farfeel::devices {
namespace {

constexpr double kBeyondFriction_N = 1.5;  // what is left of a push, once friction is overcome
constexpr double kLeastSegment_s = 0.02;   // shorter ones move a heavy handle too little
constexpr double kSegmentDelays = 2;       // an exchange that is slower blurs what lies nearer together
constexpr std::size_t kSureOfWrong = 2;    // blocks: what switches force off for good is seen twice
constexpr double kStill_m = 2e-5;          // an error below it: the hand is still, and more shakes tell no more
constexpr double kStill_m_s = 0.1;         // a hand that moves faster is waited for: it hides what a push does
// Rows and columns of the matrix, and the pauses before the shakes. In the matrix's own order, without pauses, a hand
// that shakes evenly at one of its frequencies would be a column, and certain. For the same reason no block is like the
// one before it: each turns the signs of its columns, and begins at another pause.
constexpr std::array<unsigned, AxisProbe::kShakes> kRows{5, 2, 7, 3, 1, 0, 6, 4};
constexpr std::array<unsigned, 3> kColumns{6, 4, 1};
constexpr std::array<unsigned, AxisProbe::kBlocks> kTurned{0, 5, 3, 6, 7, 1, 4, 2};
constexpr std::array<double, AxisProbe::kShakes> kPauses_s{0.045, 0.045, 0.02, 0.045, 0.0325, 0.045, 0.0325, 0.02};

}  // namespace

AxisProbe::AxisProbe(const DeviceModel& model, double max_force_N) noexcept
    : axes_(model.force_dof),
      force_N_(std::min(model.coulomb_friction_N + kBeyondFriction_N,
                        axes_ > 0 ? max_force_N / std::sqrt(static_cast<double>(axes_)) : 0)),
      step_m_(model.position_step_m),
      late_s_(model.sensor_delay_s + model.actuator_delay_s + (model.rate_Hz > 0 ? 1 / model.rate_Hz : 0)) {
  segment_s_ = std::max(kLeastSegment_s, kSegmentDelays * late_s_);
  if (axes_ == 0) verdict_ = Verdict::kNotTold;
}

double AxisProbe::sign(std::size_t shake, int axis) const noexcept {
  const unsigned turned = kTurned[shake / kShakes % kBlocks] >> static_cast<unsigned>(axis);
  const int bits = std::popcount(kRows[shake % kShakes] & kColumns[static_cast<std::size_t>(axis)]);
  return (static_cast<unsigned>(bits) + turned) % 2 == 0 ? 1 : -1;
}

glm::dvec3 AxisProbe::next(const glm::dvec3& p_BD_m, const glm::dvec3& v_BD_m_s, double dt_s) noexcept {
  if (verdict_ != Verdict::kOpen) return glm::dvec3(0);
  const double begun_s = shake_s_ - kPauses_s[(shakes_ + 3 * (shakes_ / kShakes)) % kShakes];
  if (begun_s < segment_s_ && glm::length(v_BD_m_s) > kStill_m_s) {
    interrupt();
    return glm::dvec3(0);
  }
  shake_s_ += dt_s;
  // What is read now answers what was pushed late_s_ ago.
  if (begun_s - late_s_ >= static_cast<double>(seen_) * segment_s_) {
    switch (seen_++) {
      case 0:
        first_ = p_BD_m;
        break;
      case 1:
        second_ = p_BD_m;
        break;
      case 2:
        y_[shakes_ % y_.size()] = p_BD_m - 2.0 * second_ + first_;
        break;
      default:  // the push back has been seen, too
        ++shakes_;
        interrupt();
        if (shakes_ % kShakes == 0) judge();
        return glm::dvec3(0);
    }
  }
  const double push_N = begun_s < segment_s_ || begun_s >= 3 * segment_s_ ? 0
                        : begun_s < 2 * segment_s_                        ? force_N_
                                                                          : -force_N_;
  glm::dvec3 F{0};
  for (int axis = 0; axis < axes_; ++axis) F[axis] = sign(shakes_, axis) * push_N;
  return F;
}

void AxisProbe::judge() noexcept {
  const std::size_t count = std::min(shakes_, y_.size());
  const auto n = static_cast<double>(count);
  glm::dvec3 mean{0};
  response_ = glm::dmat3(0);
  for (std::size_t k = 0; k < count; ++k) {
    mean += y_[k] / n;
    for (int axis = 0; axis < axes_; ++axis) response_[axis] += sign(k, axis) / n * y_[k];
  }
  double left_m2 = 0;
  for (std::size_t k = 0; k < count; ++k) {
    glm::dvec3 left = y_[k] - mean;
    for (int axis = 0; axis < axes_; ++axis) left -= sign(k, axis) * response_[axis];
    left_m2 += glm::dot(left, left);
  }
  // Of one component: three a shake, less those that mean and response were made of.
  error_m_ = std::sqrt(left_m2 / (3 * (n - 1 - axes_)) / n);
  const double certain_m = std::max(kCertain * error_m_, step_m_);
  bool are_all_right = true, is_any_wrong = false;
  for (int axis = 0; axis < axes_; ++axis) {
    const double size_m = glm::length(response_[axis]);
    const double along_m = response_[axis][axis];
    is_any_wrong |= size_m > certain_m && along_m < kElsewhere * size_m;
    are_all_right &= size_m > certain_m && along_m > kAlong * size_m;
  }
  const bool is_seen_twice = shakes_ >= kSureOfWrong * kShakes;
  if (are_all_right) {
    verdict_ = Verdict::kRight;
  } else if (is_seen_twice && is_any_wrong) {
    verdict_ = Verdict::kWrong;
  } else if (is_seen_twice && error_m_ < std::max(kStill_m, step_m_)) {
    verdict_ = Verdict::kNotTold;
  }
}

}  // namespace farfeel::devices
