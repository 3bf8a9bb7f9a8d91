// The convex hull of a few points, of any dimension from a point to a solid, with its Gauss map.
//
// Faces are nodes of the Gauss map (the sphere of directions), edges are arcs, vertices are cells. A flat hull is not a
// special case: it has two faces n and -n, and each edge's half circle between them is cut in two at the in-plane
// normal.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace farfeel::collision {

/// All n with n . x <= offset_m touching the hull in a face (in a vertex or an edge, for hulls of dimension < 2).
struct HullFace {
  glm::dvec3 normal;  ///< unit, outward
  double offset_m;    ///< max over the hull of normal . x
};

/// The directions in which an edge is outermost, or a part of them: the great-circle arc from `from` to `to`, shorter
/// than a half circle.
struct HullArc {
  std::array<std::uint32_t, 2> ends;  ///< the edge's two vertices, indices into ConvexHull::vertices
  glm::dvec3 along;                   ///< the edge's unit direction; along . (from x to) > 0
  glm::dvec3 from, to;                ///< unit
};

struct ConvexHull {
  int dimension = -1;                   ///< 0 a point, 1 a segment, 2 flat, 3 a solid; -1 without points
  std::vector<std::uint32_t> vertices;  ///< extreme points, as indices into the points given
  std::vector<HullFace> faces;          ///< coplanar triangles count once
  std::vector<HullArc> arcs;            ///< edges between faces that truly differ
};

/// The hull of finite points; equal points are allowed. What is thinner than 1e-12 of the points' largest extent counts
/// as flat. Predicates run in quadruple precision, so near-coplanar input is safe. Quadratic in the number of points;
/// for set-up.
[[nodiscard]] ConvexHull convex_hull(std::span<const glm::dvec3> points_m);

}  // namespace farfeel::collision
