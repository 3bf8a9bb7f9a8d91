// Which triangles of a surface may have the felt place that is nearest to a point: an octree over the space round it,
// made once, so that a point is compared with a few triangles instead of with all.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "haptic_core/contact/depth/points/faceted_surface.h"

namespace farfeel::contact {

/// Any thread may read. Knows the coarse triangles, which never change, and how far relief leaves them.
class NearestFacets {
 public:
  /// above_m, below_m: how far above and below the surface it is asked about points. around_m: how far from a point its
  /// answers still hold.
  NearestFacets(const FacetedSurface&, double above_m, double below_m, double around_m = 0);
  /// The same, but one for all in this process that would be equal: a tree takes megabytes and up to seconds, and each
  /// thread that looks at an object, and each object of one shape, would make its own. Any thread.
  [[nodiscard]] static std::shared_ptr<const NearestFacets> shared(const FacetedSurface&, double above_m,
                                                                   double below_m, double around_m = 0);

  struct Near {
    /// Among them are all triangles with felt places up to twice as far as the nearest, or nearer than 0.15 mm; none
    /// where the nearest is farther than asked for.
    std::span<const std::uint32_t> facets;
    double least_m;   ///< without facets: the nearest place is no nearer
    bool is_beneath;  ///< without facets: the point is on the inner side
  };
  /// Realtime-safe; time by the depth of the tree.
  [[nodiscard]] Near near(const glm::dvec3& p_O) const noexcept;

 private:
  struct Cell {
    std::uint32_t first = 0;  ///< of eight cells, or of facets_
    std::uint16_t count = 0;  ///< of facets
    bool is_parted = false, is_beneath = false;
    float least_m = 0;
  };

  glm::dvec3 low_O_{0};
  double side_m_ = 0, beyond_m_ = 0, around_m_;  ///< of the whole cube; from the surface to its faces, at least
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> facets_;
};

}  // namespace farfeel::contact
