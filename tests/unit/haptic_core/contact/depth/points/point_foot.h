// One point of T against S, as plainly as it can be said: what point_depth.h finds of many at once is tested against
// it.
#pragma once

#include <cstdint>
#include <span>

#include "haptic_core/contact/depth/points/faceted_surface.h"

namespace farfeel::contact {

/// One point of T against S.
struct PointFoot {
  double depth_m = 0;
  double share = 0;  ///< c_i; 0: nothing of S that faces it is within the tolerance, and the rest is unknown
  glm::dvec3 p_S{0}, slope_S{0};         ///< d depth / d p_S
  glm::dvec3 ln_share_by_rotation_S{0};  ///< of T about p_S [1/rad]
  std::uint32_t facet = 0;               ///< of S
};
/// facets: of S, those that may be nearest to p_S; nhat_S: T's coarse normal at the point.
/// Time by their number.
[[nodiscard]] PointFoot foot_of(const FacetedSurface& s, std::span<const std::uint32_t> facets, const glm::dvec3& p_S,
                                const glm::dvec3& nhat_S, double tolerance_m) noexcept;

}  // namespace farfeel::contact
