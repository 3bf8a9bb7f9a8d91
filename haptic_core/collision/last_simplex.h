// The usual case of separation(): the simplex of the last answer still holds the nearest point, and one look at all
// vertices proves it. Inlined where pairs are measured; the same arithmetic, so the same bits, as the walk itself.
#pragma once

#include <algorithm>
#include <cmath>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_support.h"

namespace farfeel::collision {

enum class Within : std::uint8_t { kSegment, kFirst, kSecond };

/// The point v of segment a b nearest to the origin, with its weights, if that is neither end.
[[gnu::always_inline]] inline Within within_segment(const glm::dvec3& a, const glm::dvec3& b, glm::dvec3& v,
                                                    double& of_a, double& of_b) {
  const glm::dvec3 e = b - a;
  const double length = glm::dot(e, e), t = -glm::dot(a, e);
  if (!(t > 0)) return Within::kFirst;
  if (!(t < length)) return Within::kSecond;
  const double s = t / length;
  of_a = 1 - s, of_b = s;
  v = a + s * e;
  return Within::kSegment;
}

/// The same for a triangle; false if the nearest point is on its border.
[[gnu::always_inline]] inline bool within_triangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                                   glm::dvec3& v, double& of_a, double& of_b, double& of_c) {
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double area = glm::dot(n, n);
  // Weights of the origin's projection, each twice a signed area times |n|.
  const double at_a = glm::dot(glm::cross(b, c), n), at_b = glm::dot(glm::cross(c, a), n),
               at_c = glm::dot(glm::cross(a, b), n);
  if (!(area > 0 && at_a > 0 && at_b > 0 && at_c > 0)) return false;
  const double share = 1 / (at_a + at_b + at_c);
  of_a = at_a * share, of_b = at_b * share, of_c = at_c * share;
  v = n * (glm::dot(a, n) / area);
  return true;
}

/// Whether the origin is inside a tetrahedron, clearly: one too flat for its volumes to be sure of is left to the walk.
[[gnu::always_inline]] inline bool is_origin_within(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                                    const glm::dvec3& d, double rounding_m) {
  const glm::dvec3 ab = glm::cross(a, b), cd = glm::cross(c, d);
  const double of_a = glm::dot(b, cd), of_b = -glm::dot(a, cd), of_c = glm::dot(d, ab), of_d = -glm::dot(c, ab);
  const double least = std::min(std::min(of_a, of_b), std::min(of_c, of_d)),
               most = std::max(std::max(of_a, of_b), std::max(of_c, of_d));
  // The volumes' rounding is about 1e-15 of the longest vector cubed, and rounding_m is 1e-12 of more than that.
  const double longest2 = std::max(std::max(glm::dot(a, a), glm::dot(b, b)), std::max(glm::dot(c, c), glm::dot(d, d)));
  const double sure = rounding_m * longest2;
  return least > sure || most < -sure;
}

/// Whether no difference of vertices lies nearer along v than v itself does: least_along is the least of them, times
/// |v|. rounding: rounding_m |v|.
[[gnu::always_inline]] inline bool is_nearest(double squared, double least_along, double rounding) {
  constexpr double kNoDecrease = 1e-15;      // of |v|^2: less is rounding
  constexpr double kSupportRounding = 1e-3;  // of rounding_m, which is 1e-12 of the coordinates' size: so 1e-15 of it
  return squared - least_along <= kNoDecrease * squared + kSupportRounding * rounding;
}

/// What separation() would answer after one step, or false when it takes more.
[[gnu::always_inline]] inline bool separation_on_last_simplex(const HullVertices& A, const HullVertices& B,
                                                              double beyond_m, double rounding_m, const PairSimplex& s,
                                                              Separation& result) {
  if (s.count == 0) return false;
  if (s.count == 4) {
    result.apartness = Apartness::kTouching;
    return is_origin_within(B.at(s.b[0]) - A.at(s.a[0]), B.at(s.b[1]) - A.at(s.a[1]), B.at(s.b[2]) - A.at(s.a[2]),
                            B.at(s.b[3]) - A.at(s.a[3]), rounding_m);
  }
  const glm::dvec3 a0 = A.at(s.a[0]), w0 = B.at(s.b[0]) - a0;
  glm::dvec3 v = w0, p_a = a0;
  if (s.count == 2) {
    const glm::dvec3 a1 = A.at(s.a[1]), w1 = B.at(s.b[1]) - a1;
    double k0, k1;
    if (within_segment(w0, w1, v, k0, k1) != Within::kSegment) return false;
    p_a = k0 * a0 + k1 * a1;
  } else if (s.count == 3) {
    const glm::dvec3 a1 = A.at(s.a[1]), w1 = B.at(s.b[1]) - a1, a2 = A.at(s.a[2]), w2 = B.at(s.b[2]) - a2;
    double k0, k1, k2;
    if (!within_triangle(w0, w1, w2, v, k0, k1, k2)) return false;
    p_a = k0 * a0 + k1 * a1 + k2 * a2;
  }
  const double squared = glm::dot(v, v), along = -reach_of_both(A, B, v);
  if (squared <= rounding_m * rounding_m) return false;
  const double length = std::sqrt(squared);
  if (along > beyond_m * length) {
    result.apartness = Apartness::kBeyond, result.distance_m = along / length;
    return true;
  }
  if (!is_nearest(squared, along, rounding_m * length)) return false;
  result = {Apartness::kApart, length, v / length, p_a, p_a + v};
  return true;
}

}  // namespace farfeel::collision
