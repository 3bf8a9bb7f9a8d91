// Contacts that are too far apart to push: only one of them an answer is searched, and the others carried on.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/penetration/carried.h"

namespace farfeel::contact_service {

/// Realtime-safe; one thread.
class FarContacts {
 public:
  explicit FarContacts(const penetration::FeltSurface& tool);

  /// No back end finds a depth of more [m]: see penetration::Query::deepest_m, and what relief can add to it.
  [[nodiscard]] double most_depth_m(const penetration::Query&) const noexcept;

  /// Whether it has been searched.
  [[nodiscard]] bool remembers(const penetration::Query& query) const noexcept {
    return slots_[query.contact % kSlots].is_of(query);
  }
  /// Before an answer's contacts.
  void begin() noexcept { most_urgent_ = 0; }
  /// Whether contact number i of the answer cannot push. Then `depth` is carried on from its last search; unknown where
  /// there was none.
  [[nodiscard]] bool takes(const penetration::Query&, std::size_t i, penetration::Penetration& depth) noexcept;

  /// Of those taken, the one whose search is most overdue. None: all have been searched not long ago.
  struct Turn {
    std::size_t i = 0;
    penetration::Query query;
  };
  [[nodiscard]] const Turn* turn() const noexcept { return most_urgent_ > kOverdue ? &turn_ : nullptr; }
  /// What was found for it; or that there is nothing to look for.
  void keep(const penetration::Penetration& found) noexcept { slot_of(turn_.query).keep(turn_.query, found); }
  void forget() noexcept { slot_of(turn_.query) = {}; }

 private:
  static constexpr std::size_t kSlots = 64;
  static constexpr double kOverdue = 0.25;  ///< of its gap, that it has gone since its search

  [[nodiscard]] penetration::Carried& slot_of(const penetration::Query& query) {
    return slots_[query.contact % kSlots];
  }

  double tool_area_m2_;
  double most_urgent_ = 0;
  Turn turn_;
  std::array<penetration::Carried, kSlots> slots_;
};

}  // namespace farfeel::contact_service
