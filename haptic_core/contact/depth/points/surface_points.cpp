#include "haptic_core/contact/depth/points/surface_points.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/depth/points/constants.h"

namespace farfeel::contact {
namespace {

double longest_m(const std::array<glm::dvec3, 3>& p) {
  return std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

void sample(const FacetedSurface& surface, const FacetedSurface::Facet& facet, const std::array<glm::dvec3, 3>& corners,
            std::uint32_t levels, glm::dvec3*& next) {
  if (levels > 0) {
    for (const auto& part : halves(corners)) sample(surface, facet, part, levels - 1, next);
    return;
  }
  const glm::dvec3 flat = (corners[0] + corners[1] + corners[2]) / 3.0;
  *next++ = flat + felt_height(surface.felt(), facet, flat).deep_m * facet.R_OH[2];
}

}  // namespace

std::array<std::array<glm::dvec3, 3>, 2> halves(const std::array<glm::dvec3, 3>& p) noexcept {
  const auto square = [&](std::size_t i, std::size_t j) { return glm::dot(p[j] - p[i], p[j] - p[i]); };
  const double ab = square(0, 1), bc = square(1, 2), ca = square(2, 0);
  const std::size_t i = ab >= bc && ab >= ca ? 0 : (bc >= ca ? 1 : 2), j = (i + 1) % 3, k = (i + 2) % 3;
  const glm::dvec3 middle = 0.5 * (p[i] + p[j]);
  return {{{p[k], p[i], middle}, {p[j], p[k], middle}}};
}

SurfacePoints::SurfacePoints(const FacetedSurface& surface)
    : surface_(&surface), levels_(surface.size()), first_(surface.size()), seen_(surface.size(), 0) {
  for (double point_m = kPoint_m;; point_m *= std::sqrt(2.0)) {
    std::size_t all = 0;
    for (std::uint32_t i = 0; i < surface.size(); ++i) {
      // Parts end up about as long as a right angle's two equal sides allow.
      const double halvings = std::log2(std::max(longest_m(surface.facet(i).corners_O) / point_m,
                                                 4 * surface.facet(i).area_m2 / (point_m * point_m)));
      levels_[i] = static_cast<std::uint32_t>(std::clamp(std::ceil(halvings), 0.0, double{kMostLevels}));
      first_[i] = static_cast<std::uint32_t>(all);
      all += count(i);
    }
    if (all > kMostPoints && all > surface.size()) continue;
    points_O_.resize(all);
    double area_m2 = 0;
    for (std::uint32_t i = 0; i < surface.size(); ++i) area_m2 += surface.facet(i).area_m2;
    usual_aside_m_ = 0.75 * point_m;
    if (all > 0) mean_area_m2_ = area_m2 / static_cast<double>(all);
    return;
  }
}

std::span<const glm::dvec3> SurfacePoints::of(std::uint32_t triangle) noexcept {
  glm::dvec3* const points = points_O_.data() + first_[triangle];
  const FacetedSurface::Facet& facet = surface_->facet(triangle);
  const std::uint64_t now = surface_->felt().changes() + 1;
  if (seen_[triangle] != now && (seen_[triangle] == 0 || facet.chart != geometry::kNoChart)) {
    glm::dvec3* next = points;
    sample(*surface_, facet, facet.corners_O, levels_[triangle], next);
    seen_[triangle] = now;
  }
  return {points, count(triangle)};
}

}  // namespace farfeel::contact
