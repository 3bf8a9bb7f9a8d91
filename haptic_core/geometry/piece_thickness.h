// How much material each convex surface piece has behind it.
#pragma once

#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::geometry {

/// Per piece [m]: from four places of each of its triangles (the middle, and half way from there to the corners)
/// straight inwards to where the coarse mesh is left again; the least of all. Rounded to float, as it travels. 0, which
/// means unknown, where no such way leaves the mesh: behind an open sheet, or of triangles without area. Reads the
/// coarse mesh and triangle_piece alone. Slow: every place meets every triangle.
[[nodiscard]] std::vector<double> measured_thickness_m(const HapticSurface&);

/// What the surface holds, or where it holds nothing yet, what is measured.
[[nodiscard]] std::vector<double> piece_thickness_m(const HapticSurface&);

}  // namespace farfeel::geometry
