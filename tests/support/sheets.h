// A box whose six faces are a convex piece each: as thin as sheets, which what presses them passes through at once.
#pragma once

#include <cmath>
#include <cstdint>

#include "haptic_core/geometry/haptic_surface.h"
#include "tests/support/solids.h"

namespace farfeel::support {

/// bend_m: how far corners of the faces across z are bent, in turns up and down, so that their hulls have a thickness.
/// Of the pieces, 5 is the top (+z) and 4 the bottom.
[[nodiscard]] inline geometry::HapticSurface box_of_sheets(const glm::dvec3& size_m, double bend_m = 0) {
  geometry::HapticSurface box = untextured(box_mesh(size_m));
  for (std::size_t t = 0; t < box.coarse.triangles.size(); ++t) {
    const glm::dvec3 n = geometry::unit_normal(box.coarse, box.coarse.triangles[t]);
    const std::uint32_t axis = std::abs(n.x) > 0.5 ? 0 : std::abs(n.y) > 0.5 ? 1 : 2;
    box.triangle_piece[t] = 2 * axis + (n[static_cast<int>(axis)] > 0);
  }
  box.piece_count = 6;
  for (glm::dvec3& p : box.coarse.positions_O) p.z += p.x * p.y > 0 ? bend_m * (p.z > 0 ? 1 : -1) : 0;
  return box;
}

}  // namespace farfeel::support
