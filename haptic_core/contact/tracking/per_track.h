// A column: what one stage keeps of each contact from one answer to the next.
//
// A track's id is a slot and a generation (track_names.h). The column has one place a slot, and knows whose it is by
// the id: what a contact that ended has left there is not found by the one that takes its slot. A stage that remembers
// one answer alone says where each answer begins.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "haptic_core/contact/tracking/track_names.h"

namespace farfeel::contact {

/// Realtime-safe; one thread.
template <typename T>
class PerTrack {
 public:
  /// Null where nothing is kept of this contact.
  [[nodiscard]] T* find(std::uint32_t id) noexcept {
    Place& place = places_[slot_of(id)];
    return place.id == id && id != 0 ? &place.kept : nullptr;
  }
  [[nodiscard]] const T* find(std::uint32_t id) const noexcept { return const_cast<PerTrack*>(this)->find(id); }
  /// Keeps something of this contact from now on: what was kept, or else a fresh T.
  [[nodiscard]] T& keep(std::uint32_t id) noexcept {
    Place& place = places_[slot_of(id)];
    if (place.id != id) place = {id, true, T{}};
    place.is_of_answer = true;
    return place.kept;
  }
  /// An answer begins: forgets what keep() was not asked for since the last time.
  void begin_answer() noexcept {
    for (Place& place : places_) {
      if (!place.is_of_answer) place.id = 0;
      place.is_of_answer = false;
    }
  }
  /// Of every contact that something is kept of.
  template <typename Visitor>
  void visit(Visitor&& visitor) noexcept {
    for (Place& place : places_)
      if (place.id != 0) visitor(place.kept);
  }
  void forget(std::uint32_t id) noexcept {
    if (Place& place = places_[slot_of(id)]; place.id == id) place.id = 0;
  }
  void restart() noexcept {
    for (Place& place : places_) place.id = 0;
  }

  [[nodiscard]] static constexpr std::size_t slot_of(std::uint32_t id) noexcept { return id % TrackNames::kSlots; }

 private:
  struct Place {
    std::uint32_t id = 0;  // 0: nobody's
    bool is_of_answer = false;
    T kept{};
  };
  std::array<Place, TrackNames::kSlots> places_{};
};

}  // namespace farfeel::contact
