// A coarse mesh from a full one, closed all the way.
#pragma once

#include <cstdint>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Collapses edges, cheapest first, until `triangles` are left or no edge may go: a collapse that would pinch the
/// surface or flip a triangle is refused, so what is closed and oriented stays so, handles included. New vertices stand
/// where the squared distance to all planes they replace is least, so the coarse surface runs through the middle of
/// fine features. Quadric error metric: Garland & Heckbert 1997, area-weighted. Deterministic.
/// Precondition: closed and oriented, finite. The result is empty if the surface touches itself in a vertex, which has
/// no half-edge structure: such vertices have to be split first (repair.h does).
[[nodiscard]] geometry::TriangleMesh edge_collapsed(const geometry::TriangleMesh&, std::uint32_t triangles);

}  // namespace farfeel::slave_sim
