// What a surface that ends in a border becomes where somebody says how thick it is.
#pragma once

#include "slave_sim/bake/found.h"
#include "slave_sim/bake/mesh_edges.h"
#include "slave_sim/bake/shells.h"

namespace farfeel::slave_sim {

/// Every shell that has a border gets a back, thickness_m behind it, and walls between the
/// two borders: what is given stays where it is, and is the front. Where it bends more sharply than that the back
/// crosses itself. Returns the shells, with a place of each. Precondition: oriented; no edge has more than two
/// triangles; thickness_m > 0.
Found thicken_open_shells(geometry::TriangleMesh&, const Shells&, const Edges&, double thickness_m);

}  // namespace farfeel::slave_sim
