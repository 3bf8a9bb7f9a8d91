#include "haptic_core/contact/faceted_surface.h"

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
    planes_.push_back({facet.nhat_O, glm::dot(facet.corners_O[0], facet.nhat_O)});
    most_relief_m_ = std::max(most_relief_m_, relief_m(i));
    most_above_m_ = std::max(most_above_m_, felt.relief(i).high_m);
  }
}

namespace {

/// Square of the distance beside the triangle, infinite over it. nearer(edge, inside_m, past_m): called for every edge
/// that is nearer than those before.
template <typename Nearer>
double square_beside_m2(const FacetedSurface::Facet& facet, const glm::dvec3& p_O, Nearer&& nearer) {
  double least_square = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 from = p_O - facet.corners_O[k];
    const double inside_m = glm::dot(from, facet.inward_O[k]);
    if (inside_m >= 0) continue;
    const double along_m = glm::dot(from, facet.along_O[k]),
                 past_m = along_m - std::clamp(along_m, 0.0, facet.length_m[k]);
    const double square = inside_m * inside_m + past_m * past_m;
    if (!(square < least_square)) continue;
    least_square = square;
    nearer(k, inside_m, past_m);
  }
  return least_square;
}

FlatDistance flat_distance(const FacetedSurface::Facet& facet, const glm::dvec3& p_O, double square_beside_m2) {
  return {glm::dot(p_O - facet.corners_O[0], facet.nhat_O),
          square_beside_m2 < std::numeric_limits<double>::infinity() ? std::sqrt(square_beside_m2) : 0};
}

}  // namespace

FlatDistance FacetedSurface::Facet::distance(const glm::dvec3& p_O, glm::dvec3& beside_O) const noexcept {
  beside_O = glm::dvec3{0};
  const double square = square_beside_m2(*this, p_O, [&](std::size_t k, double inside_m, double past_m) {
    beside_O = inside_m * inward_O[k] + past_m * along_O[k];
  });
  const FlatDistance at = flat_distance(*this, p_O, square);
  if (at.beside_m > 0) beside_O /= at.beside_m;
  return at;
}

FlatDistance FacetedSurface::Facet::distance(const glm::dvec3& p_O) const noexcept {
  return flat_distance(*this, p_O, square_beside_m2(*this, p_O, [](std::size_t, double, double) {}));
}

FeltHeight felt_height(const FeltSurface& felt, const FacetedSurface::Facet& facet, const glm::dvec3& p_O) noexcept {
  if (facet.chart == geometry::kNoChart) return {-glm::dot(p_O - facet.corners_O[0], facet.nhat_O), -facet.nhat_O};
  const geometry::Chart& chart = felt.haptic().charts[facet.chart];
  const glm::dvec3 p_H = (p_O - facet.p_OH) * facet.R_OH;
  const geometry::HeightSample h = geometry::sample_height(felt.haptic(), chart, p_H.x, p_H.y);
  return {h.h_m - p_H.z, facet.R_OH * glm::dvec3{h.h_s, h.h_t, -1}};
}

}  // namespace farfeel::contact
