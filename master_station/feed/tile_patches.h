// Where a surface's height tiles are, to be drawn: each as a patch of four corners on what is felt.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::master_station {

struct TilePatch {
  std::uint32_t tile;                  ///< of the surface
  std::array<glm::dvec3, 4> corner_O;  ///< in order around it [m], at the heights that the surface has now
};

/// Tiles that reach no triangle of their chart, baked beyond the chart's own part of the surface, are left away.
[[nodiscard]] std::vector<TilePatch> tile_patches(const geometry::HapticSurface&);

}  // namespace farfeel::master_station
