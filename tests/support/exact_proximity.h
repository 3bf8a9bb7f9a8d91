// Signed distance of two convex hulls the slow, obvious way: the oracle of the collision tests and benchmarks.
//
// It knows points only. Every triple of points counts as a face and every pair as an edge: those that are none lie
// inside the hull and lose every comparison, so no hull needs building and none can be built wrongly.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace farfeel::support {

struct ExactProximity {
  double distance_m;        ///< negative: depth along an admissible direction, see collision::ProximityPair
  double plain_distance_m;  ///< the same with every direction admissible
  bool is_admissible;       ///< overlapping only; true when apart
  glm::dvec3 direction;     ///< out of A, into B; of several equally good ones, any
};

/// A hull by its points, the unit normals of its surface (empty: every direction is outward), and, for large hulls, the
/// triangles that cover it (empty: every triple of points counts as one).
struct PointHull {
  std::vector<glm::dvec3> points;
  std::vector<glm::dvec3> outwards;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// O(n^4) without triangles: for a dozen points each. O(n^3) with them.
[[nodiscard]] ExactProximity exact_proximity(const PointHull& A, const PointHull& B);

/// max_A d.a - min_B d.b for a unit d: overlap along d, negative when d separates.
[[nodiscard]] double overlap_along(const PointHull& A, const PointHull& B, const glm::dvec3& d);

}  // namespace farfeel::support
