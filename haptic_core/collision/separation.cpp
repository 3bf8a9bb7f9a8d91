// Gilbert, Johnson and Keerthi 1988. The differences w = b - a fill a convex set; its point nearest to the origin is
// the separation. A simplex of at most four differences walks towards it: v is the simplex's nearest point, and the
// difference least along v either lies beyond v (add it) or proves that v is the answer.
#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_support.h"
#include "haptic_core/collision/last_simplex.h"
#include "haptic_core/counting/work.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;

constexpr int kMaxSteps = 100;  // 3 to 6 are usual; hulls of a thousand vertices take about 20

// The point of a simplex nearest to the origin.
struct Nearest {
  dvec3 v;
  std::array<double, 4> weight;  // of the simplex's points; 0 drops a point
  double squared;
};

void on_point(const dvec3* w, std::size_t i, Nearest& n) {
  n.weight = {}, n.weight[i] = 1;
  n.v = w[i], n.squared = dot(w[i], w[i]);
}

void on_segment(const dvec3* w, std::size_t i, std::size_t j, Nearest& n) {
  n.weight = {};
  switch (within_segment(w[i], w[j], n.v, n.weight[i], n.weight[j])) {
    case Within::kSegment:
      n.squared = dot(n.v, n.v);
      return;
    case Within::kFirst:
      return on_point(w, i, n);
    default:
      return on_point(w, j, n);
  }
}

void keep_nearer(const Nearest& other, Nearest& n) {
  if (other.squared < n.squared) n = other;
}

void on_border(const dvec3* w, std::size_t i, std::size_t j, std::size_t k, Nearest& n) {
  Nearest other;
  on_segment(w, i, j, n);
  on_segment(w, j, k, other), keep_nearer(other, n);
  on_segment(w, k, i, other), keep_nearer(other, n);
}

void on_triangle(const dvec3* w, std::size_t i, std::size_t j, std::size_t k, Nearest& n) {
  n.weight = {};
  if (!within_triangle(w[i], w[j], w[k], n.v, n.weight[i], n.weight[j], n.weight[k])) return on_border(w, i, j, k, n);
  n.squared = dot(n.v, n.v);
}

// The origin inside gives squared = 0.
void on_tetrahedron(const dvec3* w, Nearest& n) {
  n.squared = std::numeric_limits<double>::infinity();
  bool outside = false;
  constexpr std::size_t faces[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
  for (const auto& f : faces) {
    const dvec3 c = cross(w[f[1]] - w[f[0]], w[f[2]] - w[f[0]]);
    const double apex = dot(c, w[f[3]] - w[f[0]]), origin = -dot(c, w[f[0]]);
    if (apex * origin > 0) continue;  // the same side: this face is not between
    outside = true;
    Nearest other;
    on_triangle(w, f[0], f[1], f[2], other), keep_nearer(other, n);
  }
  if (!outside) n = {dvec3(0), {1, 1, 1, 1}, 0};
}

void on_simplex(const dvec3* w, std::uint32_t count, Nearest& n) {
  switch (count) {
    case 1:
      return on_point(w, 0, n);
    case 2:
      return on_segment(w, 0, 1, n);
    case 3:
      return on_triangle(w, 0, 1, 2, n);
    default:
      return on_tetrahedron(w, n);
  }
}

}  // namespace

// Of the faces that meet at a vertex, the one that holds the others is nearest to them all.
HullFeature feature_of(const HullShape& hull, std::uint32_t count,
                       const std::array<std::uint32_t, 4>& vertices) noexcept {
  const std::uint32_t first = vertices[0];
  const auto last = vertices.begin() + count;
  const auto other = std::find_if(vertices.begin(), last, [&](std::uint32_t v) { return v != first; });
  if (other == last) return {HullFeature::Kind::kVertex, first};
  const bool are_two = std::all_of(other, last, [&](std::uint32_t v) { return v == first || v == *other; });
  std::uint32_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t k = hull.edges_at[first]; k < hull.edges_at[first + 1]; ++k) {
    const HullEdge& e = hull.edges[hull.edges_at[k]];
    if (are_two && (e.ends[0] == *other || e.ends[1] == *other)) return {HullFeature::Kind::kEdge, hull.edges_at[k]};
    for (const std::uint32_t f : e.faces) {
      double off = 0;
      for (auto v = other; v != last; ++v) {
        off = std::max(off, hull.faces.offset_m[f] - dot(hull.faces.normal(f), hull.vertices.at(*v)));
      }
      if (off < least) least = off, best = f;
    }
  }
  return {HullFeature::Kind::kFace, best};
}

FARFEEL_WIDE_VECTORS
Separation separation(const HullVertices& A, const HullVertices& B, double beyond_m, double rounding_m,
                      PairSimplex& s) noexcept {
  if (s.count == 0) s = {1, {0}, {0}};
  dvec3 w[4];
  for (std::uint32_t k = 0; k < s.count; ++k) w[k] = B.at(s.b[k]) - A.at(s.a[k]);

  Nearest now{}, next;
  PairSimplex kept = s;  // the simplex that now belongs to
  double before = std::numeric_limits<double>::infinity(), length = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    counting::count(Work::kGjkSteps);
    on_simplex(w, s.count, next);
    if (next.squared <= rounding_m * rounding_m) return {Apartness::kTouching, 0, {}, {}, {}};
    if (!(next.squared < before)) break;  // rounding's floor: now stands
    now = next, before = next.squared, length = std::sqrt(next.squared);
    std::uint32_t count = 0;
    for (std::uint32_t k = 0; k < s.count; ++k) {
      if (now.weight[k] <= 0) continue;
      s.a[count] = s.a[k], s.b[count] = s.b[k], w[count] = w[k], now.weight[count] = now.weight[k];
      ++count;
    }
    s.count = count;
    kept = s;

    const double along = -reach_of_both(A, B, now.v);
    if (along > beyond_m * length) return {Apartness::kBeyond, along / length, {}, {}, {}};
    if (is_nearest(now.squared, along, rounding_m * length)) break;
    const Reach a = farthest(A, now.v), b = farthest(B, -now.v);
    bool repeated = false;
    for (std::uint32_t k = 0; k < s.count; ++k) repeated = repeated || (s.a[k] == a.vertex && s.b[k] == b.vertex);
    if (repeated) break;
    s.a[s.count] = a.vertex, s.b[s.count] = b.vertex;
    w[s.count] = B.at(b.vertex) - A.at(a.vertex);
    ++s.count;
  }
  s = kept;
  Separation result{Apartness::kApart, length, now.v / length, dvec3(0), dvec3(0)};
  for (std::uint32_t k = 0; k < s.count; ++k) result.p_a += now.weight[k] * A.at(s.a[k]);
  result.p_b = result.p_a + now.v;
  return result;
}

}  // namespace farfeel::collision
