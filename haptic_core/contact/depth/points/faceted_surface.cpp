#include "haptic_core/contact/depth/points/faceted_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::contact {

using penetration::FeltSurface;

FacetedSurface::FacetedSurface(const FeltSurface& felt) : felt_(&felt) {
  const geometry::HapticSurface& surface = felt.haptic();
  facets_.reserve(surface.coarse.triangles.size());
  for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) {
    Facet facet;
    for (std::size_t k = 0; k < 3; ++k) {
      facet.corners_O[k] = surface.coarse.positions_O[surface.coarse.triangles[i][k]];
    }
    facet.nhat_O = felt.unit_normal_O(i);
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 along = facet.corners_O[(k + 1) % 3] - facet.corners_O[k];
      const double length_m = glm::length(along);
      facet.length_m[k] = length_m;
      facet.along_O[k] = length_m > 0 ? along / length_m : glm::dvec3{0};
      facet.inward_O[k] = glm::cross(facet.nhat_O, facet.along_O[k]);
    }
    const auto& [a, b, c] = facet.corners_O;
    facet.area_m2 = 0.5 * glm::length(glm::cross(b - a, c - a));
    facet.piece = surface.triangle_piece[i];
    facet.chart = surface.triangle_chart[i];
    facet.R_OH = glm::dmat3{1};
    facet.p_OH = glm::dvec3{0};
    if (facet.chart != geometry::kNoChart) {
      facet.R_OH = glm::mat3_cast(surface.charts[facet.chart].X_OH.R);
      facet.p_OH = surface.charts[facet.chart].X_OH.p;
    }
    facets_.push_back(facet);
    most_relief_m_ = std::max(most_relief_m_, relief_m(i));
    most_above_m_ = std::max(most_above_m_, felt.relief(i).high_m);
  }
}

FlatDistance FacetedSurface::Facet::distance(const glm::dvec3& p_O) const noexcept {
  double least_square = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 from = p_O - corners_O[k];
    const double inside_m = glm::dot(from, inward_O[k]);
    if (inside_m >= 0) continue;
    const double along_m = glm::dot(from, along_O[k]), past_m = along_m - std::clamp(along_m, 0.0, length_m[k]);
    least_square = std::min(least_square, inside_m * inside_m + past_m * past_m);
  }
  return {glm::dot(p_O - corners_O[0], nhat_O),
          least_square < std::numeric_limits<double>::infinity() ? std::sqrt(least_square) : 0};
}

FeltHeight felt_height(const FeltSurface& felt, const FacetedSurface::Facet& facet, const glm::dvec3& p_O) noexcept {
  if (facet.chart == geometry::kNoChart) return {-glm::dot(p_O - facet.corners_O[0], facet.nhat_O), -facet.nhat_O};
  const geometry::Chart& chart = felt.haptic().charts[facet.chart];
  const glm::dvec3 p_H = (p_O - facet.p_OH) * facet.R_OH;
  const geometry::HeightSample h = geometry::sample_height(felt.haptic(), chart, p_H.x, p_H.y);
  return {h.h_m - p_H.z, facet.R_OH * glm::dvec3{h.h_s, h.h_t, -1}};
}

}  // namespace farfeel::contact
