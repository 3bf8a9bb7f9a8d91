// Which height tiles a contact's depth is made from.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::contact {

class TilesUnder {
 public:
  explicit TilesUnder(const penetration::Limits& limits) : patch_(limits) {}

  /// Visits every tile whose heights may decide a depth over the window, and perhaps some beside it; some twice. Stops
  /// where visit(tile) returns false, and says whether it came to the end. Realtime-safe.
  template <typename Visit>
  bool all(const penetration::Patch& patch, penetration::Side side, const penetration::Window& window,
           Visit&& visit) noexcept {
    patch_.project(patch, side, window);
    for (const penetration::Facet& facet : patch_.facets()) {
      if (!facet.chart) continue;
      const Range range = tiles_of(facet, window);
      for (std::uint32_t row = range.low_row; row < range.end_row; ++row) {
        for (std::uint32_t column = range.low_column; column < range.end_column; ++column) {
          if (!visit(facet.chart->first_tile + row * facet.chart->tiles_across() + column)) return false;
        }
      }
    }
    return true;
  }

 private:
  struct Range {
    std::uint32_t low_column, end_column, low_row, end_row;
  };
  [[nodiscard]] static Range tiles_of(const penetration::Facet&, const penetration::Window&) noexcept;

  penetration::FacingPatch patch_;
};

}  // namespace farfeel::contact
