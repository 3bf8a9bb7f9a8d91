// Gilbert, Johnson and Keerthi 1988. The differences w = b - a fill a convex set; its point nearest to the origin is
// the separation. A simplex of at most four differences walks towards it: v is the simplex's nearest point, and the
// difference least along v either lies beyond v (add it) or proves that v is the answer.
#include <cmath>
#include <limits>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_support.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;

constexpr int kMaxSteps = 100;             // 3 to 6 are usual; hulls of a thousand vertices take about 20
constexpr double kNoDecrease = 1e-15;      // of |v|^2: less is rounding
constexpr double kSupportRounding = 1e-3;  // of rounding_m, which is 1e-12 of the coordinates' size: so 1e-15 of it

struct Nearest {
  dvec3 v;
  std::array<double, 4> weight;  // of the simplex's points; 0 drops a point
  double squared;
};

Nearest on_point(const dvec3* w, int i) {
  Nearest n{w[i], {}, dot(w[i], w[i])};
  n.weight[std::size_t(i)] = 1;
  return n;
}

Nearest on_segment(const dvec3* w, int i, int j) {
  const dvec3 e = w[j] - w[i];
  const double length = dot(e, e), t = -dot(w[i], e);
  if (!(t > 0)) return on_point(w, i);
  if (!(t < length)) return on_point(w, j);
  Nearest n{};
  const double s = t / length;
  n.weight[std::size_t(i)] = 1 - s, n.weight[std::size_t(j)] = s;
  n.v = w[i] + s * e;
  n.squared = dot(n.v, n.v);
  return n;
}

const Nearest& nearer(const Nearest& a, const Nearest& b) {
  return b.squared < a.squared ? b : a;
}

Nearest on_triangle(const dvec3* w, int i, int j, int k) {
  const dvec3 ij = w[j] - w[i], ik = w[k] - w[i], n = cross(ij, ik);
  const double area = dot(n, n);
  // Weights of the origin's projection, each twice a signed area times |n|.
  const double at_i = dot(cross(w[j], w[k]), n), at_j = dot(cross(w[k], w[i]), n), at_k = dot(cross(w[i], w[j]), n);
  if (area > 0 && at_i > 0 && at_j > 0 && at_k > 0) {
    Nearest r{};
    const double sum = at_i + at_j + at_k;
    r.weight[std::size_t(i)] = at_i / sum, r.weight[std::size_t(j)] = at_j / sum, r.weight[std::size_t(k)] = at_k / sum;
    r.v = n * (dot(w[i], n) / area);
    r.squared = dot(r.v, r.v);
    return r;
  }
  return nearer(nearer(on_segment(w, i, j), on_segment(w, j, k)), on_segment(w, k, i));
}

// The origin inside gives squared = 0.
Nearest on_tetrahedron(const dvec3* w) {
  Nearest best{};
  best.squared = std::numeric_limits<double>::infinity();
  bool outside = false;
  constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};
  for (const auto& f : faces) {
    const dvec3 n = cross(w[f[1]] - w[f[0]], w[f[2]] - w[f[0]]);
    const double apex = dot(n, w[f[3]] - w[f[0]]), origin = -dot(n, w[f[0]]);
    if (apex * origin > 0) continue;  // the same side: this face is not between
    outside = true;
    best = nearer(best, on_triangle(w, f[0], f[1], f[2]));
  }
  if (outside) return best;
  return {dvec3(0), {1, 1, 1, 1}, 0};
}

Nearest on_simplex(const dvec3* w, std::uint32_t count) {
  switch (count) {
    case 1:
      return on_point(w, 0);
    case 2:
      return on_segment(w, 0, 1);
    case 3:
      return on_triangle(w, 0, 1, 2);
    default:
      return on_tetrahedron(w);
  }
}

}  // namespace

FARFEEL_WIDE_VECTORS
Separation separation(const HullVertices& A, const HullVertices& B, const dvec3& shift, double beyond_m,
                      double rounding_m, PairSimplex& s) noexcept {
  if (s.count == 0) s = {1, {0}, {0}};
  dvec3 w[4];
  for (std::uint32_t k = 0; k < s.count; ++k) w[k] = B.at(s.b[k]) - A.at(s.a[k]) + shift;

  Nearest now{};
  PairSimplex kept = s;  // the simplex that now belongs to
  double before = std::numeric_limits<double>::infinity(), length = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Nearest next = on_simplex(w, s.count);
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

    const Reach a = farthest(A, now.v), b = farthest(B, -now.v);
    const double along = dot(now.v, shift) - b.along_m - a.along_m;
    if (along > beyond_m * length) return {Apartness::kBeyond, along / length, {}, {}, {}};
    if (now.squared - along <= kNoDecrease * now.squared + kSupportRounding * rounding_m * length) break;
    bool repeated = false;
    for (std::uint32_t k = 0; k < s.count; ++k) repeated = repeated || (s.a[k] == a.vertex && s.b[k] == b.vertex);
    if (repeated) break;
    s.a[s.count] = a.vertex, s.b[s.count] = b.vertex;
    w[s.count] = B.at(b.vertex) - A.at(a.vertex) + shift;
    ++s.count;
  }
  s = kept;
  Separation result{Apartness::kApart, length, now.v / length, dvec3(0), dvec3(0)};
  for (std::uint32_t k = 0; k < s.count; ++k) result.p_a += now.weight[k] * A.at(s.a[k]);
  result.p_b = result.p_a + now.v - shift;
  return result;
}

}  // namespace farfeel::collision
