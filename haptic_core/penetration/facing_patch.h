// One patch seen along C's z axis: the double-precision height field that the reference and every refinement use.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

/// Height of a patch along C's z axis over (u, v), with derivatives. [m], [1], [1/m]
struct HeightAlong {
  double z_m;
  double z_u, z_v;
  double z_uu_1_per_m, z_uv_1_per_m, z_vv_1_per_m;
};

/// How near a point of C's plane is to the patch's own edge.
struct EdgeFade {
  double keep = 1;                     ///< 0 on the edge, 1 from kEdgeFade_m inwards, C1
  double keep_slope_1_per_m = 0;       ///< d keep / d distance
  double keep_curvature_1_per_m2 = 0;  ///< its second derivative
  glm::dvec2 inward{0};                ///< unit, from the nearest edge point to (u, v); zero when keep is 1
  glm::dvec3 p_CFoot_C{0};             ///< the nearest point of the coarse edge
};

/// A coarse triangle that faces along the direction.
struct Facet {
  std::array<glm::dvec3, 3> corners_C;
  glm::dvec3 plane;                  ///< z = plane.x + plane.y u + plane.z v
  std::array<glm::dvec3, 3> inside;  ///< edge k: x + y u + z v >= 0 inside, x + y u + z v the distance [m]
  glm::dvec2 low, high;              ///< its box in C's plane
  double reach_up_m, reach_down_m;   ///< how far the felt surface leaves the plane along +z and -z, roughly
  double most_drift_m;               ///< across the chart, from a point of the triangle to where it is felt
  std::uint32_t chart_index;         ///< geometry::kNoChart: felt as coarse
  const geometry::Chart* chart;      ///< null: felt as coarse
  glm::dmat3 R_HC;
  glm::dvec3 p_HC_H;
};

/// How far beyond a window a patch is seen: an edge there fades into it.
[[nodiscard]] inline Window within_fade_of(const Window& window) noexcept {
  return {window.low - kEdgeFade_m, window.high + kEdgeFade_m};
}
[[nodiscard]] inline bool overlaps(const Facet& facet, const Window& window) noexcept {
  return facet.low.x <= window.high.x && facet.high.x >= window.low.x && facet.low.y <= window.high.y &&
         facet.high.y >= window.low.y;
}

/// An edge of the patch itself: what lies across it faces away or belongs to nobody's list.
struct PatchEdge {
  glm::dvec3 a_C, b_C;
  glm::dvec2 low, high;  ///< its box in C's plane, grown by kEdgeFade_m
};

enum class Side { kOutermost, kInnermost };  ///< S is felt where it is highest along z, T where it is lowest

class FacingPatch {
 public:
  explicit FacingPatch(const Limits&);

  /// Keeps the patch's facing triangles whose projections touch the window. Allocates nothing.
  void project(const Patch&, Side, const Window&) noexcept;

  [[nodiscard]] std::span<const Facet> facets() const { return facets_; }
  [[nodiscard]] std::span<const PatchEdge> edges() const { return edges_; }
  /// The facet that is felt at (u, v); null outside the patch.
  [[nodiscard]] const Facet* facet_at(const glm::dvec2& uv_m) const noexcept;
  /// The same among the facets that touch the window of the last narrow(): for many points in one small place.
  void narrow(const Window&) noexcept;
  [[nodiscard]] const Facet* narrowed_facet_at(const glm::dvec2& uv_m) const noexcept;
  [[nodiscard]] bool has_several_layers_at(const glm::dvec2& uv_m) const noexcept;
  /// Height of the felt surface over (u, v), found along the ray from the facet: lateral displacement (parallax) is
  /// exact to rounding. NaN where the ray passes the texture by. Precondition: the facet lies at (u, v).
  [[nodiscard]] HeightAlong height_at(const Facet&, const glm::dvec2& uv_m) const noexcept;
  [[nodiscard]] EdgeFade fade_at(const glm::dvec2& uv_m) const noexcept;

 private:
  const geometry::HapticSurface* surface_ = nullptr;
  double outward_ = 1;  // +1 for S, -1 for T
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> narrowed_;
  std::vector<PatchEdge> edges_;
  std::vector<std::uint32_t> facing_;  // triangles of the patch
  std::vector<std::uint32_t> marks_;   // stamp_ where a triangle is one of those
  std::uint32_t stamp_ = 0;
};

}  // namespace farfeel::penetration
