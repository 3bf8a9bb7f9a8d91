// A session nobody felt: waves with known peaks, for tests of what is made from ticks.
#pragma once

#include <cmath>
#include <cstdint>

#include "master_station/haptic_loop/tick_record.h"

namespace farfeel::master_station {

/// Tick `i` of a session at 1 kHz: free for its first fifth, touching afterwards, a round trip every 5th tick.
inline TickRecord made_up_tick(std::uint64_t i, std::uint64_t of) {
  TickRecord tick;
  const double t = static_cast<double>(i) * 1e-3;
  tick.time_ns = static_cast<std::int64_t>(i) * 1'000'000;
  tick.X_WT.p = tick.X_WI.p = {0.03 * std::sin(t), 0.02 * std::cos(0.7 * t), 0.05};
  tick.pairs = static_cast<std::uint32_t>(100 + 10 * std::sin(0.5 * t));
  tick.wake_us = static_cast<float>(3 + 2 * std::abs(std::sin(37 * t)));
  tick.work_us = static_cast<float>(40 + 15 * std::sin(9 * t));
  if (i % 5 == 0) tick.rtt_ms = 2 + std::sin(3 * t);
  if (i >= of / 5) {
    tick.state = LoopState::kTouching;
    tick.contacts = static_cast<std::uint32_t>(4 + std::lround(2 * std::sin(2 * t)));
    tick.depth_max_m = 40e-6 * (1 + 0.8 * std::sin(11 * t));
    tick.F_hand_W.force_N = {0.4 * std::sin(40 * t), 0.3 * std::cos(23 * t), 2 + 0.5 * std::sin(5 * t)};
    tick.F_hand_W.torque_Nm = 0.02 * tick.F_hand_W.force_N;
    tick.F_contact_To_W = tick.F_hand_W;
    tick.coupling_energy_J = 0.002 * (1 + std::sin(5 * t));
    tick.contact_energy_J = 0.001;
    tick.tank_J = 0.01;
    tick.contact_port_J = 0.003 * t;
    tick.rung = i % 3 == 0 ? 1 : 3;
    tick.device_observer_J = 0.004 * t;
  }
  return tick;
}

}  // namespace farfeel::master_station
