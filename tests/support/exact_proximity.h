// Signed distance of two convex hulls the slow, obvious way: the oracle of the collision tests and benchmarks.
//
// It knows points only. Every triple of points counts as a face and every pair as an edge: those that are none lie
// inside the hull and lose every comparison, so no hull needs building and none can be built wrongly.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

namespace farfeel::support {

struct ExactProximity {
  double distance_m;     ///< negative: depth along an admissible direction, see collision::ProximityPair
  bool is_admissible;    ///< overlapping only; true when apart
  glm::dvec3 direction;  ///< out of A, into B; of several equally good ones, any
};

/// A hull by its points, and the unit normals of its surface (empty: every direction is outward).
struct PointHull {
  std::vector<glm::dvec3> points;
  std::vector<glm::dvec3> outwards;
};

/// O(n^4): for a dozen points each.
[[nodiscard]] ExactProximity exact_proximity(const PointHull& A, const PointHull& B);

/// max_A d.a - min_B d.b for a unit d: overlap along d, negative when d separates.
[[nodiscard]] double overlap_along(const PointHull& A, const PointHull& B, const glm::dvec3& d);

}  // namespace farfeel::support
