#include "haptic_core/penetration/window.h"

#include <algorithm>
#include <limits>

namespace farfeel::penetration {
namespace {

/// Corners of a shared part may stand out of the boxes about the facets by a rounding; steep planes see that.
constexpr double kRounding_m = 1e-9;

/// A half plane: x + y u + z v >= 0.
using HalfPlane = glm::dvec3;

double side(const HalfPlane& plane, const glm::dvec2& p) {
  return plane.x + plane.y * p.x + plane.z * p.y;
}

/// A convex polygon of fixed room: a triangle clipped by three edges, a box and one level of overlap has at most 11.
struct Polygon {
  std::array<glm::dvec2, 12> corners;
  std::size_t count = 0;

  /// Sutherland and Hodgman 1974, one plane at a time.
  void clip(const HalfPlane& plane) {
    std::array<double, 12> at;
    bool has_outside = false;
    for (std::size_t i = 0; i < count; ++i) at[i] = side(plane, corners[i]), has_outside |= at[i] < 0;
    if (!has_outside) return;  // as it mostly is
    Polygon kept;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t next = i + 1 < count ? i + 1 : 0;
      if (at[i] >= 0) kept.corners[kept.count++] = corners[i];
      if ((at[i] > 0 && at[next] < 0) || (at[i] < 0 && at[next] > 0)) {
        kept.corners[kept.count++] = corners[i] + (corners[next] - corners[i]) * (at[i] / (at[i] - at[next]));
      }
    }
    *this = kept;
  }
};

/// No corner of the facets' shared part is more on the inner side of a plane than this; -infinity where the boxes
/// about them are apart. Most pairs need no closer look.
double most_side(const HalfPlane& plane, const Facet& s, const Facet& t) {
  const glm::dvec2 low = glm::max(s.low, t.low), high = glm::min(s.high, t.high);
  if (low.x > high.x || low.y > high.y) return -std::numeric_limits<double>::infinity();
  return plane.x + std::max(plane.y * low.x, plane.y * high.x) + std::max(plane.z * low.y, plane.z * high.y) +
         kRounding_m;
}

bool is_within(const glm::dvec2& low, const glm::dvec2& high, const Window& window) {
  return low.x >= window.low.x && low.y >= window.low.y && high.x <= window.high.x && high.y <= window.high.y;
}

/// Whether the facets' shared part lies in a window for certain, as the boxes about them tell.
bool is_shared_part_within(const Facet& s, const Facet& t, const Window& window) {
  return is_within(glm::max(s.low, t.low) - kRounding_m, glm::min(s.high, t.high) + kRounding_m, window);
}

Polygon shared_part(const Facet& s, const Facet& t, const Window& outer) {
  Polygon polygon;
  if (s.low.x > t.high.x || t.low.x > s.high.x || s.low.y > t.high.y || t.low.y > s.high.y) return polygon;
  polygon.count = 3;
  for (std::size_t k = 0; k < 3; ++k) polygon.corners[k] = glm::dvec2{t.corners_C[k]};
  for (const HalfPlane& edge : s.inside) polygon.clip(edge);
  if (is_within(t.low, t.high, outer)) return polygon;
  polygon.clip({-outer.low.x, 1, 0});
  polygon.clip({outer.high.x, -1, 0});
  polygon.clip({-outer.low.y, 0, 1});
  polygon.clip({outer.high.y, 0, -1});
  return polygon;
}

}  // namespace

std::optional<Window> WindowFinder::fit(const Patch& s, const Patch& t, const Window& outer, double tail_m,
                                        double deepest_m) noexcept {
  s_.project(s, Side::kOutermost, outer);
  t_.project(t, Side::kInnermost, outer);
  double least_peak_m = -std::numeric_limits<double>::infinity();  // the greatest overlap is at least this
  for (const Facet& a : s_.facets()) {
    for (const Facet& b : t_.facets()) {
      const HalfPlane least = a.plane - b.plane + HalfPlane{a.reach_down_m - b.reach_up_m, 0, 0};
      if (!(most_side(least, a, b) > least_peak_m)) continue;
      const Polygon polygon = shared_part(a, b, outer);
      for (std::size_t i = 0; i < polygon.count; ++i) {
        const double overlap_m = side(least, polygon.corners[i]);
        if (overlap_m <= deepest_m) least_peak_m = std::max(least_peak_m, overlap_m);
      }
    }
  }
  Window window{glm::dvec2{std::numeric_limits<double>::infinity()},
                glm::dvec2{-std::numeric_limits<double>::infinity()}};
  for (const Facet& a : s_.facets()) {
    for (const Facet& b : t_.facets()) {
      if (is_shared_part_within(a, b, window)) continue;  // it would not make the window larger
      const HalfPlane most = a.plane - b.plane + HalfPlane{a.reach_up_m - b.reach_down_m, 0, 0};
      if (!(most_side(most, a, b) >= least_peak_m - tail_m)) continue;
      Polygon polygon = shared_part(a, b, outer);
      polygon.clip(most - HalfPlane{least_peak_m - tail_m, 0, 0});
      for (std::size_t i = 0; i < polygon.count; ++i) {
        window.low = glm::min(window.low, polygon.corners[i]);
        window.high = glm::max(window.high, polygon.corners[i]);
      }
    }
  }
  const glm::dvec2 size = window.high - window.low;
  if (!(size.x > 0 && size.y > 0)) return std::nullopt;
  return window;
}

}  // namespace farfeel::penetration
