// How fast a handle moves, from where it was, for devices that do not tell. Differences of successive poses, averaged
// over kTime_s, which is a few reports of a slow device and short against a hand's movements (10 Hz has 16 ms).
#pragma once

#include <cmath>
#include <cstdint>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

class VelocityEstimate {
 public:
  static constexpr double kTime_s = 0.005;
  static constexpr std::int64_t kGap_ns = 100'000'000;  ///< after so long without a report it begins anew, at rest

  /// A pose X_BD at a time later than the last; one that is not later is ignored. Allocates nothing.
  void update(const spatial::Pose& X_BD, std::int64_t time_ns) noexcept {
    const std::int64_t step_ns = time_ns - time_ns_;
    if (has_pose_ && step_ns <= 0) return;
    if (!has_pose_ || step_ns > kGap_ns) {
      V_BD_B_ = {};
    } else {
      const double step_s = 1e-9 * double(step_ns);
      // Exact for a constant velocity from rest: v' = (difference - v) / T over a step.
      const double share = -std::expm1(-step_s / kTime_s);
      const glm::dvec3 linear_m_s = (X_BD.p - X_BD_.p) / step_s;
      const glm::dvec3 angular_rad_s = spatial::vector_from_rotation(X_BD.R * glm::conjugate(X_BD_.R)) / step_s;
      V_BD_B_.linear_m_s += share * (linear_m_s - V_BD_B_.linear_m_s);
      V_BD_B_.angular_rad_s += share * (angular_rad_s - V_BD_B_.angular_rad_s);
    }
    X_BD_ = X_BD;
    time_ns_ = time_ns;
    has_pose_ = true;
  }

  [[nodiscard]] const spatial::Twist& twist() const noexcept { return V_BD_B_; }

 private:
  spatial::Pose X_BD_;
  spatial::Twist V_BD_B_;
  std::int64_t time_ns_ = 0;
  bool has_pose_ = false;
};

}  // namespace farfeel::devices
