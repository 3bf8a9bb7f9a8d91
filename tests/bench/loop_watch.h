// What a haptic loop did, tick by tick, and whether it stayed calm and made no energy.
#pragma once

#include <cstdint>
#include <string>

#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"

namespace farfeel::bench {

struct LoopFigures {
  double step_N = 0;  ///< largest change of the hand's force from tick to tick, while judged
  double ripple_share = 0;
  double force_N = 0;           ///< mean at the end
  double largest_N = 0;         ///< on the hand
  double device_min_J = 0;      ///< least of what the hand and scripts of moving objects put in
  double contact_excess_J = 0;  ///< the same of the contact port, plus the stated allowance
  double contact_bound_J = 0;   ///< what it may be below zero: K (v T)^2 / 2 of one held tick
  std::uint64_t truncations = 0;
  bool is_finite = true;
  bool is_fault = false;
};

// Gates: what an earlier prototype could hold, and stability as no force ripple above 20 Hz once a disturbance is over.
inline constexpr double kMaxStep_N = 0.2, kMaxStepShare = 0.07, kMaxRipple = 0.05;
/// No NaN, no fault, no energy beyond the bounds of either port.
[[nodiscard]] bool is_sound(const LoopFigures&, const master_station::HapticLoop&, const passivity::TankSettings& = {});

class LoopWatch {
 public:
  explicit LoopWatch(std::int64_t period_ns);
  /// After each tick; returns what that did. stiffness_N_per_m: of all that may be touched. is_judged: steps count;
  /// is_end: so does ripple.
  master_station::TickRecord look(master_station::HapticLoop&, double stiffness_N_per_m, bool is_judged, bool is_end);
  [[nodiscard]] LoopFigures figures(const master_station::HapticLoop&, const master_station::SimulatedDevice&) const;

 private:
  double dt_s_, pole_;
  LoopFigures figures_;
  glm::dvec3 last_{0}, high_{0}, sum_{0};
  double squares_ = 0, fastest_m_s_ = 0, stiffness_N_per_m_ = 0;
  int end_ticks_ = 0;
  bool has_script_ = false;
};

}  // namespace farfeel::bench
