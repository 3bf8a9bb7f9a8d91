// From a stream of ticks to the summary's figures, in a fixed amount of memory.
#pragma once

#include <optional>

#include "haptic_core/realtime/histogram.h"
#include "master_station/haptic_loop/tick_record.h"
#include "master_station/report/session_summary.h"

namespace farfeel::master_station {

/// Fed by the recorder's thread, one tick after the other.
class TickStatistics {
 public:
  void add(const TickRecord&);

  /// Fills in what ticks tell: seconds, ticks, tick_hz, ticks_missed, tick_us, wake_us, contact_share, contacts, pairs,
  /// force_N, torque_Nm, masked_torque_Nm, rtt_ms, faults, local_model's shares, states, energy but for its
  /// truncations. The rest of the summary is left alone.
  void fill(SessionSummary&) const;

 private:
  std::optional<TickRecord> first_, last_;
  std::uint64_t ticks_ = 0, ticks_in_contact_ = 0, ticks_from_tiles_ = 0, ticks_resting_ = 0, faults_ = 0;
  std::uint64_t ticks_by_outline_ = 0;
  double outline_off_m_ = 0;
  std::uint64_t contacts_ = 0, contacts_max_ = 0, pairs_ = 0, pairs_max_ = 0;
  std::array<std::uint64_t, kLoopStates> in_state_{};
  double tank_least_J_ = kNotMeasured, contact_port_least_J_ = kNotMeasured, device_port_least_J_ = kNotMeasured;
  double force_squared_ = 0, force_max_N_ = 0, torque_squared_ = 0, torque_max_Nm_ = 0;
  double masked_torque_squared_ = 0, masked_torque_max_Nm_ = 0;
  realtime::Histogram work_ns_, wake_ns_, rtt_ns_;
};

}  // namespace farfeel::master_station
