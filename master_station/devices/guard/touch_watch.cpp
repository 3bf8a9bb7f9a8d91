#include "master_station/devices/guard/touch_watch.h"

#include <algorithm>

namespace farfeel::devices {
namespace {

constexpr double kTouch_N = 0.3;
constexpr double kBrought_s = 0.02;        // for so long a hand goes on to accelerate as it did
constexpr double kQuiet_s = 0.02;          // without force before a touch is a first one
constexpr double kLeastImpulse_Ns = 0.04;  // 0.4 N for as long as a hand needs to answer
constexpr double kOfItself = 1.3;          // times J: no force gives more momentum than its impulse
constexpr double kOfItself_m_s = 0.05;     // beside that, for what readings are off
constexpr double kLong_s = 5e-3;           // a velocity is an estimate

}  // namespace

bool TouchWatch::next(const glm::dvec3& F_N, const glm::dvec3& v_m_s, double dt_s) noexcept {
  const double force_N = glm::length(F_N);
  if (touch_s_ < 0 && force_N >= kTouch_N && quiet_s_ >= kQuiet_s) {
    touch_s_ = 0;
    v_start_ = v_m_s;
    a_start_ = (v_m_s - before_[next_]) / (static_cast<double>(kKept - 1) * kEvery_s + since_kept_s_);
    impulse_ = {};
    elsewhere_s_ = 0;
  }
  quiet_s_ = force_N < kTouch_N ? quiet_s_ + dt_s : 0;
  since_kept_s_ += dt_s;
  if (since_kept_s_ >= kEvery_s) {
    since_kept_s_ = 0;
    before_[next_] = v_m_s;
    next_ = (next_ + 1) % kKept;
  }
  if (touch_s_ < 0) return false;
  touch_s_ += dt_s;
  impulse_ += dt_s * F_N;
  const double J = glm::length(impulse_);
  if (J >= kLeastImpulse_Ns) {
    const glm::dvec3 along = impulse_ / J,
                     dp = mass_kg_ * (v_m_s - v_start_ - std::min(touch_s_, kBrought_s) * a_start_);
    const double share = glm::length(dp - std::max(0.0, glm::dot(dp, along)) * along) / J;
    worst_share_ = std::max(worst_share_, share);
    elsewhere_s_ = share > kShare ? elsewhere_s_ + dt_s : 0;
  }
  if (touch_s_ >= kAnswers_s) touch_s_ = -1;
  return elsewhere_s_ >= kLong_s;
}

}  // namespace farfeel::devices
