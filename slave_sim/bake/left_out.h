// What a mesh is better without: triangles that enclose nothing, and shells that are no part of a solid.
#pragma once

#include <vector>

#include "slave_sim/bake/found.h"
#include "slave_sim/bake/mesh_edges.h"
#include "slave_sim/bake/shells.h"

namespace farfeel::slave_sim {

struct Doubled {
  Found degenerate, doubled, folded;
  geometry::TriangleMesh folds;  ///< one of each pair
};
/// Drops triangles that name a vertex twice, copies of another (all but one), and pairs back to back (both).
Doubled drop_degenerate_and_doubled(geometry::TriangleMesh&);

struct LeftOut {
  Found shells;
  geometry::TriangleMesh mesh;
  double area_share = 0;  ///< of the whole area
};
/// Drops sheets smaller than size_m that end in a border and hang on an edge that more than two triangles have.
LeftOut drop_fins(geometry::TriangleMesh&, const Shells&, const Edges&, double size_m);
/// Drops shells with less than `least` of the area, unless it is made of nothing else.
LeftOut drop_specks(geometry::TriangleMesh&, const Shells&, double least);

void drop_unused_vertices(geometry::TriangleMesh&);

/// Those of the triangles that are outside of the solid. Within it nobody feels them: a wall between two parts, a speck
/// in a casting. Precondition: the mesh is closed.
[[nodiscard]] geometry::TriangleMesh outside_of(const geometry::TriangleMesh&, geometry::TriangleMesh triangles);
void append(geometry::TriangleMesh& to, const geometry::TriangleMesh& more);

}  // namespace farfeel::slave_sim
