// What the contacts of an answer push the tool with, for whoever asks for a wrench: springs, dampers and friction,
// summed.
//
// An operator's loop computes its own in each tick and does not ask; a held wrench and the comparators that let the
// remote move the tool do (ToolPose::wants_wrench).
#pragma once

#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/friction.h"
#include "haptic_core/contact/tracking/per_track.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Realtime-safe; one thread.
class WrenchStage {
 public:
  /// Sets set.F_To_W: the sum of the penalty wrenches (penalty.h) and of the friction of every contact that presses.
  /// The tool came from from_X_WT, the pose of the set before; objects have moved since then as `moving` says. A
  /// contact that did not press in that set starts without friction. Contacts whose material has none are not
  /// remembered.
  void add(ContactSet& set, const spatial::Twist& V_WT_W, const spatial::Pose& from_X_WT,
           const motion::MovingObjects& moving) noexcept;
  void restart() noexcept {
    frictions_.restart();
    count_ = 0;
  }
  /// Contacts with friction in the last set.
  [[nodiscard]] std::uint32_t frictions() const noexcept { return count_; }

 private:
  void add_friction(ContactSet& set, const Contact& contact, const spatial::Pose& from_X_WT,
                    const motion::MovingObjects& moving) noexcept;

  PerTrack<Friction> frictions_;  // of the contacts that pressed in the set before
  std::uint32_t count_ = 0;
};

}  // namespace farfeel::contact
