// Which height tiles a contact's depth is made from.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::contact {

/// Tiles of a chart, in rows and columns.
struct TileRange {
  std::uint32_t low_column, end_column, low_row, end_row;
};

/// Those that the facet's part of a window may be felt from.
[[nodiscard]] TileRange tiles_of(const penetration::Facet&, const penetration::Window&) noexcept;

/// Visits every tile whose heights may decide a depth over the window, and perhaps some beside it; some twice. The
/// patch was projected over that window or a larger one. Realtime-safe.
template <typename Visit>
void visit_tiles_under(const penetration::FacingPatch& patch, const penetration::Window& window,
                       Visit&& visit) noexcept {
  const penetration::Window reached = penetration::within_fade_of(window);
  for (const penetration::Facet& facet : patch.facets()) {
    if (!facet.chart || !penetration::overlaps(facet, reached)) continue;
    const TileRange range = tiles_of(facet, window);
    for (std::uint32_t row = range.low_row; row < range.end_row; ++row) {
      for (std::uint32_t column = range.low_column; column < range.end_column; ++column)
        visit(facet.chart->first_tile + row * facet.chart->tiles_across() + column);
    }
  }
}

}  // namespace farfeel::contact
