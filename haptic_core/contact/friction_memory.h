// Friction across a sequence of contact sets, as the remote node answers one tool pose after another.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/friction.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Remembers each contact's friction by its id. Realtime-safe; one thread.
class FrictionMemory {
 public:
  /// Adds the friction of every pressing contact to set.F_To_W. The tool came from from_X_WT, the pose of the set
  /// before; objects have moved since then as `moving` says. A contact that was not in that set starts without any.
  /// Contacts whose material has none are not remembered.
  void add(ContactSet& set, const spatial::Pose& from_X_WT, const motion::MovingObjects& moving) noexcept;
  void restart() noexcept { count_ = 0; }
  [[nodiscard]] std::uint32_t remembered() const noexcept { return count_; }

 private:
  struct Entry {
    std::uint32_t id;
    Friction friction;
  };
  std::array<Entry, kMaxContacts> entries_{};
  std::uint32_t count_ = 0;
};

}  // namespace farfeel::contact
