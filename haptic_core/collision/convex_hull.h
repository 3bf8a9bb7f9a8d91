// The convex hull of a few points, of any dimension from a point to a solid, with its Gauss map.
//
// On the sphere of directions faces are points, edges are arcs and vertices are regions. A flat hull is not a special
// case: it has two faces, n and -n, and each of its edges a half circle between them.
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

/// An edge is outermost in the directions d perpendicular to it with limits[0] . d >= 0 and limits[1] . d >= 0: an arc
/// of at most a half circle between its two faces' normals. A segment's limits are zero: its arc is the whole circle.
struct HullEdge {
  std::array<std::uint32_t, 2> ends;   ///< indices into ConvexHull::vertices
  std::array<std::uint32_t, 2> faces;  ///< indices into ConvexHull::faces; 0, 0 for a segment
  glm::dvec3 along;                    ///< unit
  std::array<glm::dvec3, 2> limits;    ///< unit, perpendicular to along
};

struct ConvexHull {
  int dimension = -1;                   ///< 0 a point, 1 a segment, 2 flat, 3 a solid; -1 without points
  std::vector<std::uint32_t> vertices;  ///< extreme points, as indices into the points given
  std::vector<HullFace> faces;          ///< coplanar triangles count once
  std::vector<HullEdge> edges;          ///< between faces that truly differ
};

/// The hull of finite points; equal points are allowed. What is thinner than 1e-12 of the points' largest extent counts
/// as flat. Predicates run in quadruple precision, so near-coplanar input is safe. Quadratic in the number of points;
/// for set-up.
[[nodiscard]] ConvexHull convex_hull(std::span<const glm::dvec3> points_m);

}  // namespace farfeel::collision
