// Two facing patches seen together along C's z axis, in double: the overlap at a point, and its hard maximum from a
// place near it.
#pragma once

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::penetration {

inline constexpr double kNoOverlapThere_m = -std::numeric_limits<double>::infinity();

/// Both surfaces over one point of C's plane.
struct Overlap {
  HeightAlong s, t;
  double d_m = kNoOverlapThere_m;
  glm::dvec2 slope{0};
  double d_uu = 0, d_uv = 0, d_vv = 0;  // [1/m]

  [[nodiscard]] double bend() const { return std::abs(d_uu) + 2 * std::abs(d_uv) + std::abs(d_vv); }
};

struct Peak {
  glm::dvec2 uv{0};
  Overlap at;
  bool is_inside = false;  ///< the slope vanishes there; else an edge of a patch or of the window holds it
};

/// Refers to two projected patches; made where it is used.
struct OverlapView {
  const FacingPatch &s, &t;
  double deepest_m;  ///< coarse overlaps beyond belong to another layer

  /// False where a patch is missing.
  [[nodiscard]] bool at(const glm::dvec2& uv, Overlap&) const noexcept;
  [[nodiscard]] bool of(const Facet& s_facet, const Facet& t_facet, const glm::dvec2& uv, Overlap&) const noexcept;
  /// Newton from `start` to the top of its peak, inside the window, in steps of at most longest_step_m; where an edge
  /// holds it, along the edge if to_the_edge.
  [[nodiscard]] Peak climb(const glm::dvec2& start, const Window&, const glm::dvec2& longest_step_m,
                           bool to_the_edge) const noexcept;
  /// Depth, derivatives and doubts of the hard maximum that a peak is.
  [[nodiscard]] Penetration hard_maximum(const Query&, const Peak&) const noexcept;
};

[[nodiscard]] inline double coarse_overlap_m(const Facet& s, const Facet& t, const glm::dvec2& uv) noexcept {
  return glm::dot(s.plane - t.plane, glm::dvec3{1, uv});
}

}  // namespace farfeel::penetration
