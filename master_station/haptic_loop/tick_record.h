// What one tick leaves behind: everything that reports, plots and tables are made from.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "haptic_core/local_model/pushes.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::master_station {

enum class LoopState : std::uint8_t {
  kFree,      ///< fresh contacts, no force from them
  kTouching,  ///< fresh contacts, the tool is pressed
  kHeld,      ///< the newest contacts are 50 ms older than the lane takes: the last geometry is held
  kFading,    ///< and 250 ms: the force fades to zero
  kFault,     ///< something was not finite or broke a limit: the force is ramped down and stays off
  kPaused     ///< a person asked for it: the same
};

inline constexpr std::size_t kLoopStates = 6;

[[nodiscard]] constexpr std::string_view name(LoopState state) {
  switch (state) {
    case LoopState::kFree:
      return "free";
    case LoopState::kTouching:
      return "touching";
    case LoopState::kHeld:
      return "held";
    case LoopState::kFading:
      return "fading";
    case LoopState::kFault:
      return "fault";
    case LoopState::kPaused:
      return "paused";
  }
  return "unknown";
}

/// One tick. A plain value: it crosses to the recorder through a queue that drops and counts.
struct TickRecord {
  std::uint64_t number = 0;        ///< of the tick, from 0 on
  std::int64_t time_ns = 0;        ///< since the loop started
  spatial::Pose X_WI;              ///< the handle's image in the world: scaled, and left where the clutch let go
  spatial::Pose X_WT;              ///< the simulated tool; of constraints its proxy on the surface
  spatial::Wrench F_hand_W;        ///< on the hand, about the handle's origin, after all limits
  double masked_torque_Nm = 0;     ///< wanted, of a device that has no torque
  spatial::Wrench F_contact_To_W;  ///< of the local model on the tool, about To
  double depth_max_m = 0;          ///< deepest contact of the local model; 0 when none overlaps
  std::uint32_t contacts = 0;      ///< contacts of the local model that press at this tick
  std::uint32_t by_outline = 0;    ///< of these: their heights are late, and the outline's stand in
  double outline_off_m = 0;        ///< and how far from the true one the depth of such is, at most
  std::uint32_t pairs = 0;         ///< pairs of pieces near, as the newest contacts say
  double rtt_ms = std::numeric_limits<double>::quiet_NaN();  ///< NaN when no new contacts arrived
  float wake_us = 0;                                         ///< how late the tick began
  float work_us = 0;                                         ///< how long the previous tick worked
  LoopState state = LoopState::kFree;
  std::uint8_t rung = 0;           ///< felt: 0 held wrench, 1 linear, clamped (any contact), 2 quadratic, 3 tiles (all)
  bool is_resting = false;         ///< rung 1 because tiles rest: too many ticks that felt them did not fit
  std::uint64_t ticks_missed = 0;  ///< so far

  double coupling_energy_J = 0;  ///< stored in the virtual coupling
  double contact_energy_J = 0;   ///< stored in the local model's contacts
  double tank_J = 0;             ///< what updates of the local model may still add; < 0: a debt, paid as damping
  double contact_port_J = 0;     ///< energy the tool has put into the local model less what it got back
  double script_work_J = 0;    ///< energy that objects which move by a script put into the local model, less what back
  local_model::Pushes pushes;  ///< the contacts as felt; none where a comparator renders
  double device_observer_J = 0;  ///< energy the hand has put into the loop less what it got back; NaN if not observed
};

}  // namespace farfeel::master_station
