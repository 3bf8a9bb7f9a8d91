// Pairs of convex pieces chosen to be hard: for every library, with the oracle's answer.
#pragma once

#include <string>
#include <vector>

#include "tests/support/exact_proximity.h"

namespace farfeel::bench {

struct CollisionCase {
  std::string what;
  support::PointHull A, B;
  double size_m;      ///< what errors are measured against
  double distance_m;  ///< true signed distance, every direction allowed
};

/// Touching, coplanar, parallel edges, slivers, points and segments, deep, far away; at scales from 1e-3 to 1e3.
[[nodiscard]] std::vector<CollisionCase> degenerate_cases();
/// Hulls of random points of a 4 x 4 x 4 lattice, so that coincidences are the rule.
[[nodiscard]] std::vector<CollisionCase> lattice_cases(std::size_t count);

}  // namespace farfeel::bench
