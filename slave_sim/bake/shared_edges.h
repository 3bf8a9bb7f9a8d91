// Edges that more or fewer than two triangles have, where that can be mended without moving anything.
#pragma once

#include "slave_sim/bake/found.h"
#include "slave_sim/bake/mesh_edges.h"

namespace farfeel::slave_sim {

/// Where a vertex of a border lies on a border's edge (a T-junction), no further off than width_m, the edge's triangle
/// is cut in two there, so that both sides have the same edges. Returns the cuts.
Found cut_at_t_junctions(geometry::TriangleMesh&, double width_m);

/// Where solids share an edge, each gets its own: of the triangles round it those belong together that have the solid
/// between them, by the way they face; corners that no triangles connect any more are named apart. Edges whose
/// triangles do not take turns in facing stay as they are. Returns the edges that were parted. Precondition: oriented.
Found part_shared_edges(geometry::TriangleMesh&, const Edges&);

}  // namespace farfeel::slave_sim
