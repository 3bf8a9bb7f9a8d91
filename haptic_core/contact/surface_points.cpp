#include "haptic_core/contact/surface_points.h"

#include <algorithm>
#include <cmath>

namespace farfeel::contact {
namespace {

/// Longest side of what counts as a point, where the whole surface takes no more points than that.
constexpr double kPoint_m = 0.3e-3;
constexpr std::size_t kMostPoints = 1u << 17;
constexpr std::uint32_t kMostLevels = 8;

double longest_m(const std::array<glm::dvec3, 3>& p) {
  return std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

void sample(const FacetedSurface& surface, const FacetedSurface::Facet& facet, const std::array<glm::dvec3, 3>& corners,
            std::uint32_t levels, glm::dvec3*& next) {
  if (levels > 0) {
    for (const auto& part : quarters(corners)) sample(surface, facet, part, levels - 1, next);
    return;
  }
  const glm::dvec3 flat = (corners[0] + corners[1] + corners[2]) / 3.0;
  *next++ = flat + felt_height(surface.felt(), facet, flat).deep_m * facet.R_OH[2];
}

}  // namespace

std::array<std::array<glm::dvec3, 3>, 4> quarters(const std::array<glm::dvec3, 3>& p) noexcept {
  const glm::dvec3 ab = 0.5 * (p[0] + p[1]), bc = 0.5 * (p[1] + p[2]), ca = 0.5 * (p[2] + p[0]);
  return {{{p[0], ab, ca}, {p[1], bc, ab}, {p[2], ca, bc}, {ab, bc, ca}}};
}

SurfacePoints::SurfacePoints(const FacetedSurface& surface)
    : surface_(&surface), levels_(surface.size()), first_(surface.size()), seen_(surface.size(), 0) {
  for (double point_m = kPoint_m;; point_m *= std::sqrt(2.0)) {
    std::size_t all = 0;
    for (std::uint32_t i = 0; i < surface.size(); ++i) {
      const double halvings = std::ceil(std::log2(longest_m(surface.facet(i).corners_O) / point_m));
      levels_[i] = static_cast<std::uint32_t>(std::clamp(halvings, 0.0, double{kMostLevels}));
      first_[i] = static_cast<std::uint32_t>(all);
      all += count(i);
    }
    if (all > kMostPoints && all > surface.size()) continue;
    points_O_.resize(all);
    double area_m2 = 0;
    for (std::uint32_t i = 0; i < surface.size(); ++i) area_m2 += surface.facet(i).area_m2;
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
