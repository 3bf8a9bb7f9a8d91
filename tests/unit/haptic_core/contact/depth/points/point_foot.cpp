#include "tests/unit/haptic_core/contact/depth/points/point_foot.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::contact {
namespace {

using penetration::simd::kFacesBelow;
using penetration::simd::kFullNearness;
using penetration::simd::kLeastNearness;
using penetration::simd::kNearnessWithin_m;
using penetration::simd::kNotAbove;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double smooth_step(double x) {
  return x * x * (3 - 2 * x);
}
double smooth_step_slope(double x) {
  return 6 * x * (1 - x);
}
/// Of its logarithm.
double smooth_step_ln_slope(double x) {
  return 6 * (1 - x) / (x * (3 - 2 * x));
}

/// The unit way from the nearest place of the triangle's edges, in its plane.
glm::dvec3 way_beside(const FacetedSurface::Facet& facet, const glm::dvec3& p_S) {
  double least_m = kInfinity;
  glm::dvec3 way_S{0};
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 from = p_S - facet.corners_O[k];
    const double inside_m = glm::dot(from, facet.inward_O[k]), along_m = glm::dot(from, facet.along_O[k]);
    const glm::dvec3 beside =
        inside_m * facet.inward_O[k] + (along_m - std::clamp(along_m, 0.0, facet.length_m[k])) * facet.along_O[k];
    if (inside_m >= 0 || !(glm::length(beside) < least_m)) continue;
    least_m = glm::length(beside);
    way_S = least_m > 0 ? beside / least_m : glm::dvec3{0};
  }
  return way_S;
}

/// How deep p is under one triangle's felt surface; where it is beside the triangle, under or over its edge. sign: 1 on
/// the inner side of the coarse surface, -1 on the outer.
FeltHeight under(const FacetedSurface& s, const FacetedSurface::Facet& facet, const glm::dvec3& p_S, double sign,
                 bool is_square) noexcept {
  const FeltHeight height = felt_height(s.felt(), facet, p_S);
  if (is_square) return height;
  const glm::dvec3 beside_S = way_beside(facet, p_S);
  const double beside_m = facet.distance(p_S).beside_m;
  if (!(sign * height.deep_m > 0)) return {height.deep_m + sign * beside_m, height.slope_O + sign * beside_S};
  const double away_m = std::sqrt(height.deep_m * height.deep_m + beside_m * beside_m);
  return {sign * away_m, (std::abs(height.deep_m) * height.slope_O + sign * beside_m * beside_S) / away_m};
}

}  // namespace

// The coarse surface says on which side of it p is: its nearest triangle does, since it is closed. On the inner side
// the least of the depths beneath triangles that have p beneath them counts, on the outer side the greatest: relief can
// make neighbours of the nearest the nearest, but not triangles that p is on the other side of. All this once among the
// triangles that face p, and on the inner side once among all.
PointFoot foot_of(const FacetedSurface& s, std::span<const std::uint32_t> facets, const glm::dvec3& p_S,
                  const glm::dvec3& nhat_S, double tolerance_m) noexcept {
  PointFoot foot;
  foot.p_S = p_S;
  const auto faces = [&](std::uint32_t i) { return glm::dot(s.facet(i).nhat_O, nhat_S) < kNotAbove; };
  struct Nearest {
    double square = kInfinity, above_m = 0, reach_m = 0;  ///< another whose felt place is nearer is no farther, but for
    std::uint32_t facet = 0;                              ///< its own relief
  } of_all, facing;
  for (const std::uint32_t i : facets) {
    const FlatDistance at = s.facet(i).distance(p_S);
    const double square = at.square_m2() - kPrefersSquare * at.above_m * at.above_m;
    const Nearest one{square, at.above_m, (1 + kPrefersSquare) * std::sqrt(square) + s.relief_m(i), i};
    if (square < of_all.square) of_all = one;
    if (square < facing.square && faces(i)) facing = one;
  }
  if (!(facing.square < tolerance_m * tolerance_m)) return foot;
  const double sign = of_all.above_m < 0 ? 1 : -1;  // of what is deeper
  // On the outer side what faces p across a valley is farther and so pushes less: nothing else need be known.
  if (sign < 0 && !(facing.above_m > 0)) return foot;
  const auto best_of = [&](const Nearest& nearest, bool only_facing, std::uint32_t& which) {
    FeltHeight best{sign * kInfinity, {}};
    for (const std::uint32_t i : facets) {
      const FlatDistance at = s.facet(i).distance(p_S);
      const double limit_m = nearest.reach_m + s.relief_m(i);
      if ((only_facing && !faces(i)) || at.above_m * sign > 0 || at.square_m2() > limit_m * limit_m) continue;
      const FeltHeight height = under(s, s.facet(i), p_S, sign, at.beside_m == 0);
      if (sign * height.deep_m < sign * best.deep_m) best = height, which = i;
    }
    return best;
  };
  const FeltHeight near_facing = best_of(facing, true, foot.facet);
  if (!std::isfinite(near_facing.deep_m)) return foot;
  foot.depth_m = near_facing.deep_m, foot.slope_S = near_facing.slope_O;
  const glm::dvec3& nhat_facet_S = s.facet(foot.facet).nhat_O;
  const double x = (kNotAbove - glm::dot(nhat_facet_S, nhat_S)) / (kNotAbove - kFacesBelow);
  foot.share = 1;
  if (x < 1) {
    foot.share = smooth_step(x);
    foot.ln_share_by_rotation_S =
        -smooth_step_ln_slope(x) / (kNotAbove - kFacesBelow) * glm::cross(nhat_S, nhat_facet_S);
  }
  if (sign < 0 || of_all.facet == facing.facet) return foot;
  std::uint32_t other = 0;
  const FeltHeight near_any = best_of(of_all, false, other);
  const double most_m = std::max(near_facing.deep_m, 0.0) + kNearnessWithin_m,
               nearness = (std::max(near_any.deep_m, 0.0) + kNearnessWithin_m) / most_m,
               y = std::clamp((nearness - kLeastNearness) / (kFullNearness - kLeastNearness), 0.0, 1.0);
  if (y >= 1 || !(near_facing.deep_m > 0)) return foot;
  if (!(y > 0)) foot.share = 0;
  foot.depth_m = smooth_step(y) * near_facing.deep_m;
  foot.slope_S = smooth_step(y) * near_facing.slope_O + smooth_step_slope(y) * near_facing.deep_m /
                                                            ((kFullNearness - kLeastNearness) * most_m) *
                                                            (near_any.slope_O - nearness * near_facing.slope_O);
  return foot;
}

}  // namespace farfeel::contact
