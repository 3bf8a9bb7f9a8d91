// A felt surface as flat triangles with edges, each with its heights: what points are measured against.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "haptic_core/penetration/felt_surface.h"
#include "haptic_core/penetration/simd/simd_feet.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// Where a point lies against a triangle: above its plane, and beside its edges.
struct FlatDistance {
  double above_m, beside_m;  ///< beside >= 0; 0 over the triangle
  [[nodiscard]] double square_m2() const { return above_m * above_m + beside_m * beside_m; }
};

/// Refers to the felt surface, which outlives it. Any thread may read.
class FacetedSurface {
 public:
  struct Facet {
    std::array<glm::dvec3, 3> corners_O;
    std::array<glm::dvec3, 3> along_O, inward_O;  ///< of edge (k, k + 1): unit, in the plane
    std::array<double, 3> length_m;
    glm::dvec3 nhat_O;
    double area_m2;
    std::uint32_t piece, chart;  ///< chart: geometry::kNoChart where felt as coarse
    glm::dmat3 R_OH;
    glm::dvec3 p_OH;

    [[nodiscard]] FlatDistance distance(const glm::dvec3& p_O) const noexcept;
  };
  explicit FacetedSurface(const penetration::FeltSurface&);

  [[nodiscard]] const Facet& facet(std::uint32_t triangle) const { return facets_[triangle]; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(facets_.size()); }
  [[nodiscard]] const penetration::FeltSurface& felt() const { return *felt_; }
  /// How far the felt surface leaves the coarse one, over one triangle and over any, at most [m].
  [[nodiscard]] double relief_m(std::uint32_t triangle) const {
    return std::max(-felt_->relief(triangle).low_m, felt_->relief(triangle).high_m);
  }
  [[nodiscard]] double most_relief_m() const { return most_relief_m_; }
  /// How far above the coarse one it comes; 0 where nowhere.
  [[nodiscard]] double most_above_m() const { return most_above_m_; }

 private:
  const penetration::FeltSurface* felt_;
  double most_relief_m_ = 0, most_above_m_ = 0;
  std::vector<Facet> facets_;
};

/// How far p is under the felt surface of a facet, along the facet's chart, and how that changes with p.
struct FeltHeight {
  double deep_m;
  glm::dvec3 slope_O;
};
[[nodiscard]] FeltHeight felt_height(const penetration::FeltSurface&, const FacetedSurface::Facet&,
                                     const glm::dvec3& p_O) noexcept;

/// Which side of two triangles that meet a point is on; see simd_feet.h.
using penetration::simd::kPrefersSquare;

}  // namespace farfeel::contact
