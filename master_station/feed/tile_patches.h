// Where a surface's height tiles are, to be drawn: each as the triangles of what is felt there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::master_station {

struct TilePatch {
  std::uint32_t tile;                                       ///< of the surface
  std::vector<std::array<glm::dvec3, 3>> triangles_O = {};  ///< [m], at the heights that the surface has now
};

/// Together they cover the coarse triangles that have a chart, each cut where tiles meet. A tile that no triangle of
/// its chart reaches, baked beyond the chart's own part of the surface, is left away.
[[nodiscard]] std::vector<TilePatch> tile_patches(const geometry::HapticSurface&);

}  // namespace farfeel::master_station
