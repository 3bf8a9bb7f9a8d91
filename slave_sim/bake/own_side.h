// Whether the hull of a piece keeps to its own side of the material.
//
// A patch of a surface bounds material on one side. Its hull may go into that material, but no further than to the
// middle between the patch and what bounds the material on the other side: a tool that meets the hull from there would
// be pushed out through the wrong surface. Of a point q of the hull let `which` be the patch's triangle nearest to q;
//   depth  = distance from q to the nearest triangle that faces within 60 degrees of `which`, whoever's it is,
//   across = distance from q to the nearest triangle that faces further away.
// q is allowed if depth <= tolerance, or if q is inside the solid and (depth - across) / 2 <= tolerance.
#pragma once

#include <cstdint>
#include <span>

#include "haptic_core/geometry/triangle_mesh.h"
#include "slave_sim/bake/triangle_tree.h"

namespace farfeel::slave_sim {

/// How far a point of a hull is where it should not be [m].
struct Breach {
  double outside_m = 0;      ///< distance from the solid
  double past_middle_m = 0;  ///< half of depth - across
};

/// The triangles of a piece; not empty.
using Patch = std::span<const std::uint32_t>;

class OwnSide {
 public:
  /// How finely a face is looked at: until what is left unseen is smaller than this share of the face, or least_m.
  struct Fineness {
    double share, least_m;
  };

  /// The mesh must outlive this.
  OwnSide(const geometry::TriangleMesh& mesh, double tolerance_m);
  OwnSide(const OwnSide&) = delete;  // own_ points into tree_
  OwnSide& operator=(const OwnSide&) = delete;

  /// Every point of a hull's face, given by its corners, is allowed.
  [[nodiscard]] bool allows(const geometry::Triangle& face, Patch, const Fineness&);
  /// What is wrong with a point of its hull.
  [[nodiscard]] Breach breach(const glm::dvec3& q_O, Patch);

 private:
  struct Judgement {
    bool is_allowed;
    double safe_m;  ///< all points nearer than this are allowed as well
  };
  // These are of the patch that own_ has.
  [[nodiscard]] Judgement judged(const glm::dvec3& q, double reach_m) const;
  /// To the patch; way: the normal of its nearest triangle.
  [[nodiscard]] double own_m(const glm::dvec3& q, glm::dvec3& way) const;
  [[nodiscard]] double depth_m(const glm::dvec3& q, const glm::dvec3& way, double within_m) const;   ///< or within_m
  [[nodiscard]] double across_m(const glm::dvec3& q, const glm::dvec3& way, double within_m) const;  ///< or within_m

  const geometry::TriangleMesh& mesh_;
  TriangleTree tree_;
  TriangleTree::Some own_;
  double tolerance_m_;
};

}  // namespace farfeel::slave_sim
