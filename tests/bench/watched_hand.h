// A hand with a device that is guarded, over a flat surface, in simulated time: drawn at random from a seed, for the
// alarms of the guard's watches. Models of device, grips, stiffnesses, ways to touch, links, stalls and wrong wirings.
#pragma once

#include <cstdint>
#include <string>

namespace farfeel::bench {

/// What happens beside the touch.
enum class Disturbance { kNone, kLinkOutage, kMachineFreeze, kObjectMoves };

struct WatchedCase {
  std::uint64_t seed = 1;
  bool is_new_device = false;  ///< its axes are tried, and it begins at a fifth
  bool is_miswired = false;    ///< the touched axis goes elsewhere: another one, or the other way
  Disturbance disturbance = Disturbance::kNone;
};

struct WatchedOutcome {
  std::string what;         ///< model, grip, motion: for a person
  std::string alarm;        ///< the fault that was told; empty: none
  bool is_touched = false;  ///< 0.3 N on the hand, or half of what the device gives at first
  double told_s = -1;       ///< from the touch to the alarm; below zero: before it
  double given_J = 0;       ///< the most that the device gave the hand on top of what it took before
  bool is_back = true;      ///< force is there again at the end, where the hand still presses and holds the grip
  double tried_s = 0;       ///< that a new device took to try its axes
};

[[nodiscard]] WatchedOutcome watch(const WatchedCase&);

}  // namespace farfeel::bench
