#include "tests/bench/loop_watch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::bench {
namespace {

constexpr double kPortBound_J = 1e-6;  // the design's: or K (v T)^2 / 2, if that is more
constexpr double kLeastMean_N = 0.5;   // ripple is judged against a force that a hand presses with

}  // namespace

LoopWatch::LoopWatch(std::int64_t period_ns)
    : dt_s_(1e-9 * static_cast<double>(period_ns)), pole_(std::exp(-2 * std::numbers::pi * 20 * dt_s_)) {}

master_station::TickRecord LoopWatch::look(master_station::HapticLoop& loop, double stiffness_N_per_m, bool is_judged,
                                           bool is_end) {
  master_station::TickRecord record;
  loop.records().pop(record);
  const glm::dvec3 force = record.F_hand_W.force_N;
  figures_.is_finite = figures_.is_finite && spatial::is_finite(record.F_hand_W) && spatial::is_valid(record.X_WT);
  figures_.largest_N = std::max(figures_.largest_N, glm::length(force));
  if (is_judged) figures_.step_N = std::max(figures_.step_N, glm::length(force - last_));
  high_ = pole_ * (high_ + force - last_);
  last_ = force;
  if (is_end) squares_ += glm::dot(high_, high_), sum_ += force, ++end_ticks_;
  const local_model::LocalModel& model = loop.local_model();
  fastest_m_s_ = std::max(fastest_m_s_, glm::length(loop.tool().V_WT_W.linear_m_s));
  stiffness_N_per_m_ = std::max(stiffness_N_per_m_, stiffness_N_per_m);
  const double script_J = record.script_work_J;
  has_script_ = has_script_ || script_J != 0;
  figures_.contact_excess_J =
      std::min(figures_.contact_excess_J, model.contact_port().energy_J() + script_J + model.tank().allowed_J());
  figures_.device_min_J = std::min(figures_.device_min_J, record.device_observer_J + script_J);
  return record;
}

LoopFigures LoopWatch::figures(const master_station::HapticLoop& loop,
                               const master_station::SimulatedDevice& device) const {
  LoopFigures f = figures_;
  f.contact_bound_J = std::max(kPortBound_J, 0.5 * stiffness_N_per_m_ * std::pow(fastest_m_s_ * dt_s_, 2));
  f.force_N = glm::length(sum_) / end_ticks_;
  f.ripple_share = std::sqrt(squares_ / end_ticks_) / std::max(f.force_N, kLeastMean_N);
  if (!has_script_) f.device_min_J = device.hand_port().least_J();  // at the simulation's own steps
  f.truncations = loop.local_model().truncations();
  f.is_fault = loop.fault() != master_station::Fault::kNone;
  return f;
}

bool is_sound(const LoopFigures& f, const master_station::HapticLoop& loop, const passivity::TankSettings& tank) {
  return f.is_finite && !f.is_fault && f.device_min_J >= -(tank.cap_J + loop.local_model().tank().allowed_J()) &&
         f.contact_excess_J >= -f.contact_bound_J;
}

}  // namespace farfeel::bench
