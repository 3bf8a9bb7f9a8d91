// The directions that lead out of a convex piece, cut out of its hull's sphere of directions.
//
// A direction leads out of a piece when it is at most 90 degrees from the outward normal of one of its triangles. Those
// that do not form a convex cone; its rim cuts the hull's arcs and regions. With the rim's corners as further faces and
// the rim's arcs as further edges, "least over the outward directions" is a search of the same kind as "least over
// all".
#pragma once

#include <span>

#include "haptic_core/collision/convex_hull.h"

namespace farfeel::collision {

/// Faces and edges in three groups: those that face outward at least in part, the rim's, the others.
/// A rim arc's two ends are one vertex, the outermost along all of it, and its `along` is the triangle's normal.
struct OutwardMap {
  std::vector<HullFace> faces;
  std::vector<HullEdge> edges;
  std::uint32_t outward_faces = 0;  ///< the first two groups
  std::uint32_t outward_edges = 0;
};

/// points_m: what hull.vertices index. outwards: unit; none: every direction leads out, and there is no rim.
[[nodiscard]] OutwardMap outward_map(const ConvexHull& hull, std::span<const glm::dvec3> points_m,
                                     std::span<const glm::dvec3> outwards);

}  // namespace farfeel::collision
