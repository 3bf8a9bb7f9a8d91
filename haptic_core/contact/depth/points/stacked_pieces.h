// Which pieces of one surface lie above each other: the flights of a thread, the lip of an undercut over what it grips.
// Seen along a direction that both face, only the outermost is seen: a contact among them is no height field.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::contact {

class StackedPieces {
 public:
  /// Two pieces are stacked where triangles of theirs that face within 60 degrees of each other hide parts of each
  /// other, more than 0.3 mm and at most reach_m apart, with an underside between. Takes the time of a search over all
  /// near pairs of triangles.
  StackedPieces(const geometry::HapticSurface&, double reach_m);

  /// The pieces above or below this one, ascending.
  [[nodiscard]] std::span<const std::uint32_t> with(std::uint32_t piece) const {
    return {others_.data() + start_[piece], others_.data() + start_[piece + 1]};
  }
  [[nodiscard]] bool is_empty() const { return others_.empty(); }

 private:
  std::vector<std::uint32_t> start_, others_;
};

}  // namespace farfeel::contact
