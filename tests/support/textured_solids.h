// Closed solids whose every face carries relief, and what a brute-force look at their dense points says of how deep two
// of them overlap, whichever way their contact faces.
#pragma once

#include <functional>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::support {

/// The solid of support::untextured with a chart over each of its plane faces, felt relief_m(p_O) above the face at its
/// point p_O, along the face's normal.
[[nodiscard]] geometry::HapticSurface textured(geometry::TriangleMesh mesh,
                                               const std::function<double(const glm::dvec3& p_O)>& relief_m,
                                               double texel_m = 0.05e-3);

struct DensePoint {
  glm::dvec3 p_O, nhat_O;  ///< of the felt surface; outward
  double area_m2;
};
/// Points of the felt surface about spacing_m apart, over the coarse triangles that `counts` says by their centre.
[[nodiscard]] std::vector<DensePoint> dense_points(const geometry::HapticSurface&, double spacing_m,
                                                   const std::function<bool(const glm::dvec3& centre_O)>& counts);

struct DenseDepth {
  double depth_m;       ///< of T's deepest point behind S's surface, measured to the plane of its nearest point
  glm::dvec3 p_S;       ///< that point, in S
  glm::dvec3 nhat_S_S;  ///< S's normal there
  /// w ln of the integral of exp(depth / w) over a0, over T's points.
  double soft_depth_m;
};
/// Every point of T against the nearest point of S that faces it, within reach_m; depth -infinity when there is none.
/// Behind S is what the nearest points of all have behind them, and is not twice as near to those.
[[nodiscard]] DenseDepth dense_depth(const std::vector<DensePoint>& s, const std::vector<DensePoint>& t,
                                     const spatial::Pose& X_ST, double reach_m, double soft_width_m,
                                     double reference_area_m2);

}  // namespace farfeel::support
