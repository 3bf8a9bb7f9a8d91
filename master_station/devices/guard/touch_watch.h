// Whether a device goes where its force pushes, told at each first touch.
//
// Work does not tell it: where a motor or a sensor has the wrong sign, the handle runs into the force that should stop
// it, which looks like a hand that pushes. But a hand needs some 100 ms to answer what it feels, and until then can
// only resist, as a spring and damper do. So from the touch on, with J the impulse of the force on the hand since then,
// m the mass at the handle, and a0 the acceleration that the hand brought along,
//
//   dp = m (v - v0 - a0 t)
//
// lies along J or is small. What of dp does not, though it is more than kShare of J, came from a force that is not the
// one that was asked for: an axis is swapped, or has the wrong sign. What is more than J itself no force of the device
// gave: a hand strikes, and that touch tells nothing. A hand that holds against such a force moves
// little, and is not told so; nor does the handle run away then.
#pragma once

#include <array>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

/// Realtime-safe.
class TouchWatch {
 public:
  static constexpr double kAnswers_s = 0.06;  ///< of a hand: voluntary reactions take longer than stretch reflexes
  static constexpr double kShare = 0.2;

  explicit TouchWatch(double mass_kg) noexcept : mass_kg_(mass_kg) {}

  /// F was on the hand for dt_s, and v is the handle's velocity after it. True: it goes elsewhere.
  bool next(const glm::dvec3& F_N, const glm::dvec3& v_m_s, double dt_s) noexcept;
  void restart() noexcept { *this = TouchWatch(mass_kg_); }
  [[nodiscard]] double worst_share() const noexcept { return worst_share_; }  ///< of J, at any touch so far

 private:
  static constexpr std::size_t kKept = 5;
  static constexpr double kEvery_s = 5e-3;

  double mass_kg_;
  std::array<glm::dvec3, kKept> before_{};  // velocities, one every kEvery_s, the oldest at next_
  std::size_t next_ = 0;
  double since_kept_s_ = 0, quiet_s_ = 0, touch_s_ = -1, elsewhere_s_ = 0, worst_share_ = 0;
  glm::dvec3 v_start_{0}, a_start_{0}, impulse_{0};
};

}  // namespace farfeel::devices
