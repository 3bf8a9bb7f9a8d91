// The coarse mesh that contacts are looked for on, from a full one.
#pragma once

#include <cstdint>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Without the relief that is finer than a quarter of a coarse triangle's side, and closed as the full mesh is. Where
/// material is thin, neither the flattening nor the collapsing moves the surface by more than a quarter of its
/// thickness (or 0.1 mm, where it is thinner than 0.4 mm): so the two sides of a sheet stay apart. Where the coarse
/// surface is off along its normals the heights make up for it; where its edges are off nothing does: a face that goes
/// on beyond the edge is felt there. So the free edges of what has no relief stay within 0.075 mm where that takes at
/// most half as many triangles again, which ragged edges would not. `triangles` are exceeded where either needs more;
/// what is thick and has no such edges gets what it would get anyway. What takes no more triangles as it is, like a
/// cube of 48, stays as it is. Empty where edge_collapsed() is. Precondition: closed and oriented, finite.
[[nodiscard]] geometry::TriangleMesh coarse_mesh(const geometry::TriangleMesh& full, std::uint32_t triangles);

}  // namespace farfeel::slave_sim
