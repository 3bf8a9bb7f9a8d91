#include "master_station/report/tick_statistics.h"

#include <algorithm>
#include <cmath>

namespace farfeel::master_station {

void TickStatistics::add(const TickRecord& tick) {
  if (!first_) first_ = tick;
  const bool was_faulty = last_ && last_->state == LoopState::kFault;
  if (tick.state == LoopState::kFault && !was_faulty) ++faults_;
  last_ = tick;

  ++ticks_;
  if (tick.contacts > 0) ++ticks_in_contact_;
  contacts_ += tick.contacts;
  contacts_max_ = std::max<std::uint64_t>(contacts_max_, tick.contacts);
  pairs_ += tick.pairs;
  pairs_max_ = std::max<std::uint64_t>(pairs_max_, tick.pairs);

  const double force_N = glm::length(tick.F_hand_W.force_N);
  const double torque_Nm = glm::length(tick.F_hand_W.torque_Nm);
  force_squared_ += force_N * force_N;
  force_max_N_ = std::max(force_max_N_, force_N);
  torque_squared_ += torque_Nm * torque_Nm;
  torque_max_Nm_ = std::max(torque_max_Nm_, torque_Nm);

  // The first tick has no tick before it whose work it could tell.
  if (ticks_ > 1) work_us_.add(tick.work_us);
  wake_us_.add(tick.wake_us);
  rtt_ms_.add(tick.rtt_ms);
}

void TickStatistics::fill(SessionSummary& s) const {
  s.ticks = ticks_;
  s.faults = faults_;
  if (ticks_ == 0) return;

  const auto n = static_cast<double>(ticks_);
  s.seconds = static_cast<double>(last_->time_ns - first_->time_ns) * 1e-9;
  if (s.seconds > 0) s.tick_hz = (n - 1) / s.seconds;
  s.ticks_missed = last_->ticks_missed;
  const auto times = [](const RunningQuantiles& q) {
    return LoopTimes{q.quantile(0.5), q.quantile(0.99), q.quantile(0.999), q.max()};
  };
  s.tick_us = times(work_us_);
  s.wake_us = times(wake_us_);
  s.contact_share = static_cast<double>(ticks_in_contact_) / n;
  if (ticks_in_contact_ > 0)
    s.contacts.mean_in_contact = static_cast<double>(contacts_) / static_cast<double>(ticks_in_contact_);
  s.contacts.max = static_cast<double>(contacts_max_);
  s.pairs = {static_cast<double>(pairs_) / n, static_cast<double>(pairs_max_)};
  s.force_N = {std::sqrt(force_squared_ / n), force_max_N_};
  s.torque_Nm = {std::sqrt(torque_squared_ / n), torque_max_Nm_};
  s.rtt_ms = {rtt_ms_.quantile(0.5), rtt_ms_.quantile(0.99)};
}

}  // namespace farfeel::master_station
