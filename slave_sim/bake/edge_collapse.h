// A coarse mesh from a full one, closed all the way.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Collapses edges, cheapest first, until `triangles` are left or no edge may go: a collapse that would pinch the
/// surface or flip a triangle is refused, so what is closed and oriented stays so, handles included. New vertices stand
/// where the squared distance to all planes they replace is least, so the coarse surface runs through the middle of
/// fine features. Quadric error metric: Garland & Heckbert 1997, area-weighted. Deterministic.
/// Precondition: closed and oriented, finite. The result is empty if the surface touches itself in a vertex, which has
/// no half-edge structure: such vertices have to be split first (repair.h does).
/// most_off_m, unless empty: per vertex of the mesh, how far from it the surface may be in the end (tested from the
/// last sixteen times `triangles` on); infinite where that does not matter. Collapses that would go further are
/// refused, and then more than `triangles` are left: all others go on only until they cost what they would have cost
/// without.
/// most_edge_off_m, unless empty: likewise, how far an edge of the result may be from a free edge, where the surface
/// turns away by more than 40 degrees, that has such a vertex at both ends.
[[nodiscard]] geometry::TriangleMesh edge_collapsed(const geometry::TriangleMesh&, std::uint32_t triangles,
                                                    const std::vector<double>& most_off_m = {},
                                                    const std::vector<double>& most_edge_off_m = {});

/// The same in sweeps over all edges, each collapsing the cheapest: near enough to cheapest first while the triangles
/// that are left are still fine, and several times as fast. At least `triangles` are left.
[[nodiscard]] geometry::TriangleMesh edges_swept(const geometry::TriangleMesh&, std::uint32_t triangles);

}  // namespace farfeel::slave_sim
