// What a proximity query answers: pairs of convex surface pieces nearer than a tolerance.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace farfeel::collision {

/// One pair of convex pieces, one of scene object S, one of tool T, nearer than the tolerance. In S's frame.
/// Contract: distance_m = (p_St_S - p_Ss_S) . nhat_ST_S within rounding; positive apart, negative when they overlap.
/// Source: signed distance after Ehmann & Lin 2001; overlap restricted to the pieces' outward cones.
struct ProximityPair {
  std::uint32_t piece_s, piece_t;
  double distance_m;
  glm::dvec3 p_Ss_S;     ///< witness on S's piece
  glm::dvec3 p_St_S;     ///< witness on T's piece
  glm::dvec3 nhat_ST_S;  ///< unit, out of S, into T
  bool is_admissible;    ///< false: no direction lies in both outward cones; the plain least translation is given
};

}  // namespace farfeel::collision
