// Contacts that have found the same place of the surface, whatever their clusters' directions: they press there once.
//
// Of any two contacts of one object that are near each other and push the same way the shallower one's stiffness and
// damping fade. How much the two are one, A in 0 ... 1, changes with the tool's pose, and fast: the point of a contact
// may go ten times as far as the tool does. A spring that stores k (1 - A) depth^2 / 2 but pushes along its depth's
// gradient alone leaves out what it stores by A. Such forces have no potential: where A is a function of the pose, a
// heavy tool that swings a little in its place is given at each swing what damping takes, and swings on. So A goes
// after that function slowly, by the way past each other and by time: a swing finds it as it was, a stroke takes it
// along.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/tracking/per_track.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Realtime-safe; one thread.
class DuplicateWeights {
 public:
  /// Two contacts whose points are apart_m apart are two, at half of that they are one.
  explicit DuplicateWeights(double apart_m) : apart_m_(apart_m) {}

  /// Two push the same way fully within 18 degrees, not at all beyond 37. The shallower one of two that are one loses
  /// all; two as deep share what one has. Those with hardly any left are dropped, order kept. Contacts whose pair did
  /// not press yet are taken as they are now. The tool came from from_X_WT, the pose of the set dt_s before; objects
  /// have moved since then as `moving` says.
  void fade(ContactSet& set, const spatial::Pose& from_X_WT, const motion::MovingObjects& moving, double dt_s) noexcept;
  void restart() noexcept { known_.restart(); }

 private:
  struct Known {
    bool presses = false;
    std::array<float, TrackNames::kSlots> sameness{};  ///< A with each of the set by its slot, as the one that fades
  };

  double apart_m_;
  PerTrack<Known> known_;  // of the last set, before any was dropped
};

}  // namespace farfeel::contact
