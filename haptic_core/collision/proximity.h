// What a proximity query answers: pairs of convex surface pieces nearer than a tolerance.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace farfeel::collision {

/// A vertex, edge or face of a piece's hull, by its index in ConvexPieces::shape() of that piece. The name is stable:
/// it depends on the surface alone. A face may also be a corner of the rim that bounds the outward directions, see
/// OutwardMap.
struct HullFeature {
  enum class Kind : std::uint32_t { kVertex, kEdge, kFace };
  Kind kind = Kind::kVertex;
  std::uint32_t index = 0;
  friend bool operator==(const HullFeature&, const HullFeature&) = default;
};

/// One pair of convex pieces, one of scene object S, one of tool T, nearer than the tolerance. In S's frame.
/// Contract: distance_m = (p_St_S - p_Ss_S) . nhat_ST_S within rounding; positive apart, negative when they overlap.
/// Overlap is the least translation of T over the admissible directions: those at most 90 degrees from the outward
/// normal of some triangle of S's piece, whose opposites are so for T's piece. Pieces that face the same way (every
/// pair of their outward normals within 10 degrees) have no admissible direction: the plain least translation is given.
/// Of overlapping pieces the witnesses are the places of what reaches farthest along nhat, and against it, that are
/// nearest to each other across nhat.
/// Source: signed distance after Ehmann & Lin 2001.
struct ProximityPair {
  std::uint32_t piece_s, piece_t;
  double distance_m;
  glm::dvec3 p_Ss_S;                 ///< witness on S's piece
  glm::dvec3 p_St_S;                 ///< witness on T's piece
  glm::dvec3 nhat_ST_S;              ///< unit, out of S, into T
  HullFeature feature_s, feature_t;  ///< that the witnesses lie on; overlapping: whose normal nhat is, or that it meets
  double facing;       ///< [0, 1] how squarely nhat leads out of S and into T: product of its cosines with the nearest
                       ///< outward normals; 0 is grazing, or through a back face
  bool is_admissible;  ///< apart: nhat lies in both outward cones; overlapping: some direction does
};

}  // namespace farfeel::collision
