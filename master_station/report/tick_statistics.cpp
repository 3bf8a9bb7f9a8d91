#include "master_station/report/tick_statistics.h"

#include <algorithm>
#include <cmath>

namespace farfeel::master_station {
namespace {

double quantile(const realtime::Histogram& times, double share, double ns_per_unit) {
  return static_cast<double>(times.quantile_ns(share)) / ns_per_unit;
}

LoopTimes loop_times_us(const realtime::Histogram& times) {
  if (times.count() == 0) return {};
  constexpr double kNs = 1e3;
  return {quantile(times, 0.5, kNs), quantile(times, 0.99, kNs), quantile(times, 0.999, kNs),
          static_cast<double>(times.max_ns()) / kNs};
}

}  // namespace

void TickStatistics::add(const TickRecord& tick) {
  if (!first_) first_ = tick;
  const bool was_faulty = last_ && last_->state == LoopState::kFault;
  if (tick.state == LoopState::kFault && !was_faulty) ++faults_;
  last_ = tick;

  ++ticks_;
  if (tick.contacts > 0) ++ticks_in_contact_;
  if (tick.rung == 3) ++ticks_from_tiles_;
  if (tick.is_resting) ++ticks_resting_;
  if (tick.by_outline > 0) ++ticks_by_outline_;
  outline_off_m_ = std::max(outline_off_m_, tick.outline_off_m);
  ++in_state_[static_cast<std::size_t>(tick.state)];
  tank_least_J_ = std::fmin(tank_least_J_, tick.tank_J);  // fmin: the other where one is NaN
  contact_port_least_J_ = std::fmin(contact_port_least_J_, tick.contact_port_J + tick.script_work_J);
  device_port_least_J_ = std::fmin(device_port_least_J_, tick.device_observer_J + tick.script_work_J);
  contacts_ += tick.contacts;
  contacts_max_ = std::max<std::uint64_t>(contacts_max_, tick.contacts);
  pairs_ += tick.pairs;
  pairs_max_ = std::max<std::uint64_t>(pairs_max_, tick.pairs);

  const double force_N = glm::length(tick.F_hand_W.force_N);
  const double torque_Nm = glm::length(tick.F_hand_W.torque_Nm);
  force_squared_ += force_N * force_N;
  force_max_N_ = std::max(force_max_N_, force_N);
  masked_torque_squared_ += tick.masked_torque_Nm * tick.masked_torque_Nm;
  masked_torque_max_Nm_ = std::max(masked_torque_max_Nm_, tick.masked_torque_Nm);
  torque_squared_ += torque_Nm * torque_Nm;
  torque_max_Nm_ = std::max(torque_max_Nm_, torque_Nm);

  // The first tick has no tick before it whose work it could tell.
  if (ticks_ > 1) work_ns_.add(std::llround(1e3 * static_cast<double>(tick.work_us)));
  wake_ns_.add(std::llround(1e3 * static_cast<double>(tick.wake_us)));
  if (std::isfinite(tick.rtt_ms)) rtt_ns_.add(std::llround(1e6 * tick.rtt_ms));
}

void TickStatistics::fill(SessionSummary& s) const {
  s.ticks = ticks_;
  s.faults = faults_;
  if (ticks_ == 0) return;

  const auto n = static_cast<double>(ticks_);
  s.seconds = static_cast<double>(last_->time_ns - first_->time_ns) * 1e-9;
  if (s.seconds > 0) s.tick_hz = (n - 1) / s.seconds;
  s.ticks_missed = last_->ticks_missed;
  s.tick_us = loop_times_us(work_ns_);
  s.wake_us = loop_times_us(wake_ns_);
  s.contact_share = static_cast<double>(ticks_in_contact_) / n;
  s.local_model.tiles_share = static_cast<double>(ticks_from_tiles_) / n;
  s.local_model.resting_share = static_cast<double>(ticks_resting_) / n;
  s.local_model.outline_share = static_cast<double>(ticks_by_outline_) / n;
  s.local_model.outline_off_m = outline_off_m_;
  if (ticks_in_contact_ > 0)
    s.contacts.mean_in_contact = static_cast<double>(contacts_) / static_cast<double>(ticks_in_contact_);
  s.contacts.max = static_cast<double>(contacts_max_);
  s.pairs = {static_cast<double>(pairs_) / n, static_cast<double>(pairs_max_)};
  for (std::size_t i = 0; i < kLoopStates; ++i) s.states.of[i] = static_cast<double>(in_state_[i]) / n;
  s.energy.tank_least_J = tank_least_J_;
  s.energy.contact_port_least_J = contact_port_least_J_;
  s.energy.device_port_least_J = device_port_least_J_;
  s.energy.contact_port_J = last_->contact_port_J;
  s.energy.device_port_J = last_->device_observer_J;
  s.force_N = {std::sqrt(force_squared_ / n), force_max_N_};
  s.masked_torque_Nm = {std::sqrt(masked_torque_squared_ / n), masked_torque_max_Nm_};
  s.torque_Nm = {std::sqrt(torque_squared_ / n), torque_max_Nm_};
  if (rtt_ns_.count() > 0) s.rtt_ms = {quantile(rtt_ns_, 0.5, 1e6), quantile(rtt_ns_, 0.99, 1e6)};
}

}  // namespace farfeel::master_station
