// Names of contacts by which whatever is kept of them is found: no two contacts of an answer have names that are equal
// modulo 64, however many objects there are.
//
// A name is a slot, its low bits, and how often the slot was taken. The slot is a key and no order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "haptic_core/contact/contact_set.h"

namespace farfeel::contact {

/// Realtime-safe; one thread.
class TrackNames {
 public:
  /// What was named in the last update and the contacts of this one fit beside each other.
  static constexpr std::uint32_t kSlots = 2 * kMaxContacts;

  /// Before an update's contacts.
  void begin() noexcept { ++update_; }
  /// Of a cluster of an object, as in the last update; a new one where it had none. At most kMaxContacts an update. A
  /// new name takes the slot that nobody has held for longest: what is still known of a contact that ended stays.
  [[nodiscard]] std::uint32_t name(std::uint32_t object, std::uint32_t cluster) noexcept;
  /// Names begin anew.
  void restart() noexcept { *this = {}; }

 private:
  struct Slot {
    std::uint32_t object = 0, cluster = 0;
    std::uint32_t times_taken = 0;
    std::uint64_t named = 0;  // in this update last; 0: never
  };

  std::array<Slot, kSlots> slots_{};
  std::uint64_t update_ = 1;
};

}  // namespace farfeel::contact
