// The penetration depth of two patches without texture, without a grid: over two plane triangles the overlap is linear,
// and the soft maximum's integral of exp(overlap / w) has a closed form.
#pragma once

#include <vector>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::contact {

/// One thread at a time.
class PlaneDepth {
 public:
  explicit PlaneDepth(const penetration::Limits&);

  /// Depth, point and gradient in C, as a back end answers them; the triangles are taken as they are, texture or not.
  /// Differs from a back end in that edges are sharp (a back end fades them over kEdgeFade_m), and that triangles count
  /// until they stand upright; where layers lie above each other the outermost outweighs the rest. Unknown when the
  /// patches share no part of the plane. Where wants_hessian, by differences of the gradient.
  /// Precondition: soft_width_m > 0. Realtime-safe: allocates nothing, cannot fail.
  [[nodiscard]] penetration::Penetration evaluate(const penetration::Query&) noexcept;

 private:
  struct Facet {
    std::array<glm::dvec3, 3> corners_C;  ///< counter-clockwise seen along -z
    glm::dvec3 plane;                     ///< z = plane.x + plane.y u + plane.z v
    glm::dvec2 low, high;
  };
  void project(const penetration::Patch&, double outward, std::vector<Facet>&) const noexcept;
  [[nodiscard]] penetration::Penetration integrate(const penetration::Query&, const glm::dvec3& p_CTo_C) noexcept;

  std::vector<Facet> s_, t_;
};

}  // namespace farfeel::contact
