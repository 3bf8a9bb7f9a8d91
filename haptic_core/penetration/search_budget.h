// Depths on a budget, for callers that ask so often that a contact hardly moves from one call to the next: the ticks of
// a haptic loop. Some contacts of a call are searched, those first whose last search is oldest; the others are carried
// from their last search by its gradient, and cost next to nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "haptic_core/penetration/carried.h"

namespace farfeel::penetration {

inline constexpr std::uint32_t kMostCarries = 8;   ///< calls for which a contact may be carried
inline constexpr double kMostCarried_m = 0.12e-3;  ///< and the way along the surface: a fraction of a ridge

/// Knows contacts by Query::contact; of a query only that, the surfaces, the poses and wants_hessian are looked at. Off
/// by the depth's curvature times half the square of the way carried: 0.1 um rms at 0.1 m/s and 4 kHz over ridges of
/// 1.5 mm. Realtime-safe; one thread.
class SearchBudget {
 public:
  /// Calls since the last search, for which it was carried; kNever where it has to be searched: it is new, has no name,
  /// has gone too far, or its Hessian is wanted.
  static constexpr std::uint32_t kNever = ~0u;
  [[nodiscard]] std::uint32_t carries(const Query& query) const noexcept {
    const Slot& slot = slots_[query.contact % kSlots];
    const bool can_be_carried = slot.last.is_of(query) && !query.wants_hessian && slot.carries < kMostCarries &&
                                slot.last.way_m(query) < kMostCarried_m;
    return can_be_carried ? slot.carries : kNever;
  }
  /// Precondition: carries(query) != kNever.
  [[nodiscard]] Penetration carried(const Query& query) noexcept {
    Slot& slot = slots_[query.contact % kSlots];
    ++slot.carries;
    return slot.last.carried_to(query);
  }
  /// What a search found.
  void keep(const Query& query, const Penetration& found) noexcept {
    if (!found.is_known()) return;
    Slot& slot = slots_[query.contact % kSlots];
    slot.last.keep(query, found);
    slot.carries = 0;
  }
  void restart() noexcept { slots_ = {}; }

 private:
  static constexpr std::size_t kSlots = 64;
  struct Slot {
    Carried last;
    std::uint32_t carries = 0;
  };
  std::array<Slot, kSlots> slots_;
};

}  // namespace farfeel::penetration
