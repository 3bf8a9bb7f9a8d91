// How a query's time grows with the size of the hulls and with the number of pieces.
#pragma once

#include "tests/bench/collision_peer.h"

namespace farfeel::bench {

/// Exponents of fitted power laws: time ~ size^exponent.
struct CollisionScaling {
  double with_hull_vertices = 0;  ///< two round hulls of 16 to 1,024 vertices rolling over each other
  double with_pieces = 0;         ///< two spheres of 100 to 6,400 flat pieces, the tolerance shrinking with the pieces
};

[[nodiscard]] CollisionScaling collision_scaling(const CollisionLibrary&);

}  // namespace farfeel::bench
