// With I = integral of exp(d / w) over the shared part of the plane, depth = w ln(I / a0). Over a triangle whose
// corners have overlaps w x_i, and with e[...] the divided differences of exp (Hermite and Genocchi's formula),
//   integral exp(x) dA = 2 A e[x_1, x_2, x_3],   integral l_i exp(x) dA = 2 A e[x_1, x_2, x_3, x_i]
// for the barycentric l_i. When T moves, d changes at a fixed point by g, and the shared part's border moves where it
// is T's: by Reynolds' transport theorem dI = integral exp(d / w) g / w dA + integral exp(d / w) (v . n) ds over T's
// edges. Edges that two triangles share cancel by themselves.
#include "haptic_core/contact/depth/plane_depth.h"

#include <algorithm>
#include <cmath>

namespace farfeel::contact {
namespace {

using penetration::Penetration;
using penetration::Query;
using spatial::Vector6;

/// Triangles that stand steeper than 87 degrees to the plane are left out: what they add has no area.
constexpr double kLeastFacing = 0.05;
/// Overlaps this many soft widths below the highest seen add nothing.
constexpr double kTailWidths = 36;
constexpr double kDifference_m = 1e-7;  ///< step of the Hessian's differences

/// e[x_0 ... x_n] of ascending x. Where they lie close together the recursion would cancel: a series about their mean,
/// in complete homogeneous symmetric polynomials.
template <int N>
double exp_difference(const double* x) {
  if constexpr (N == 0) {
    return std::exp(x[0]);
  } else {
    constexpr double kClose = 0.7;
    constexpr int kTerms = 12;
    if (x[N] - x[0] > kClose) return (exp_difference<N - 1>(x + 1) - exp_difference<N - 1>(x)) / (x[N] - x[0]);
    double mean = 0;
    for (int i = 0; i <= N; ++i) mean += x[i] / (N + 1);
    // h[k] over the first i + 1 nodes from those over the first i: h_k += y_i h_(k-1).
    std::array<double, kTerms> h{1};
    for (int i = 0; i <= N; ++i) {
      for (int k = 1; k < kTerms; ++k) h[k] += (x[i] - mean) * h[k - 1];
    }
    double sum = 0, factorial = 1;
    for (int k = 2; k <= N; ++k) factorial *= k;
    for (int k = 0; k < kTerms; ++k) {
      sum += h[k] / factorial;
      factorial *= N + k + 1;
    }
    return std::exp(mean) * sum;
  }
}

template <int N>
double sorted_exp_difference(std::array<double, N + 1> x) {
  std::sort(x.begin(), x.end());
  return exp_difference<N>(x.data());
}

double cross2(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

double at(const glm::dvec3& plane, const glm::dvec2& uv) {
  return plane.x + plane.y * uv.x + plane.z * uv.y;
}

/// A convex polygon; edge i runs from corner i to the next one and may be T's. Three corners clipped four times.
struct Polygon {
  std::array<glm::dvec2, 8> corners;
  std::array<bool, 8> is_t;
  std::size_t count = 0;

  /// Keeps what is inside: x + y u + z v >= 0. The new edge is no edge of T's. Sutherland and Hodgman 1974.
  void clip(const glm::dvec3& inside) {
    Polygon kept;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec2 &a = corners[i], &b = corners[(i + 1) % count];
      const double at_a = at(inside, a), at_b = at(inside, b);
      if (at_a >= 0) kept.add(a, at_b >= 0 || at_a > 0 ? is_t[i] : false);
      if (at_a > 0 && at_b < 0) kept.add(a + (b - a) * (at_a / (at_a - at_b)), false);
      if (at_a < 0 && at_b > 0) kept.add(a + (b - a) * (at_a / (at_a - at_b)), is_t[i]);
    }
    *this = kept;
  }
  void add(const glm::dvec2& corner, bool edge_is_t) {
    if (count == corners.size()) return;
    corners[count] = corner;
    is_t[count++] = edge_is_t;
  }
};

/// Sums over all polygons, weighted by exp(d / w - level).
struct Sums {
  double weight = 0;
  glm::dvec3 point{0};
  Vector6 change = Vector6::Zero();  // d I / d pose, times w

  void scale(double by) { weight *= by, point *= by, change *= by; }
};

}  // namespace

PlaneDepth::PlaneDepth(const penetration::Limits& limits) {
  s_.reserve(limits.coarse_triangles);
  t_.reserve(limits.coarse_triangles);
}

void PlaneDepth::project(const penetration::Patch& patch, double outward, std::vector<Facet>& facets) const noexcept {
  facets.clear();
  const geometry::TriangleMesh& mesh = patch.surface->haptic().coarse;
  for (const std::uint32_t i : patch.triangles) {
    const glm::dvec3 n = spatial::rotate(patch.X_CO, patch.surface->unit_normal_O(i));
    if (!(outward * n.z > kLeastFacing) || facets.size() == facets.capacity()) continue;
    Facet facet;
    for (std::size_t k = 0; k < 3; ++k) {
      facet.corners_C[k] = spatial::transform_point(patch.X_CO, mesh.positions_O[mesh.triangles[i][k]]);
    }
    if (outward < 0) std::swap(facet.corners_C[1], facet.corners_C[2]);
    const auto& [a, b, c] = facet.corners_C;
    facet.low = glm::min(glm::min(glm::dvec2{a}, glm::dvec2{b}), glm::dvec2{c});
    facet.high = glm::max(glm::max(glm::dvec2{a}, glm::dvec2{b}), glm::dvec2{c});
    facet.plane = {a.z + (n.x * a.x + n.y * a.y) / n.z, -n.x / n.z, -n.y / n.z};
    facets.push_back(facet);
  }
}

Penetration PlaneDepth::evaluate(const Query& query) noexcept {
  project(query.s, 1, s_);
  project(query.t, -1, t_);
  Penetration answer = integrate(query, query.t.X_CO.p);
  if (!query.wants_hessian || !answer.is_known()) return answer;
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? kDifference_m / 0.01 : kDifference_m;  // rotations act 10 mm away
    Vector6 gradients[2];
    for (const int side : {0, 1}) {
      const Vector6 q = (side == 0 ? step : -step) * Vector6::Unit(k);
      Query moved = query;
      moved.t.X_CO.R = glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * moved.t.X_CO.R);
      moved.t.X_CO.p += glm::dvec3{q[3], q[4], q[5]};
      project(moved.t, -1, t_);
      const Penetration there = integrate(moved, moved.t.X_CO.p);
      gradients[side] = there.is_known() ? there.gradient : answer.gradient;
    }
    answer.hessian.col(k) = (gradients[0] - gradients[1]) / (2 * step);
  }
  answer.hessian = (0.5 * (answer.hessian + answer.hessian.transpose())).eval();
  return answer;
}

Penetration PlaneDepth::integrate(const Query& query, const glm::dvec3& p_CTo_C) noexcept {
  const double w = query.soft_width_m;
  Sums sums;
  double level = -std::numeric_limits<double>::infinity();  // of d / w
  for (const Facet& s : s_) {
    for (const Facet& t : t_) {
      if (s.low.x > t.high.x || t.low.x > s.high.x || s.low.y > t.high.y || t.low.y > s.high.y) continue;
      Polygon shared;
      for (const glm::dvec3& corner : t.corners_C) shared.add(glm::dvec2{corner}, true);
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec2 a{s.corners_C[k]}, along = glm::dvec2{s.corners_C[(k + 1) % 3]} - a;
        shared.clip({-cross2(along, a), -along.y, along.x});
      }
      const glm::dvec3 overlap = s.plane - t.plane;
      if (query.deepest_m < 1e3) shared.clip(glm::dvec3{query.deepest_m, 0, 0} - overlap);
      if (shared.count < 3) continue;

      double highest = -std::numeric_limits<double>::infinity();
      std::array<double, 8> x;
      for (std::size_t i = 0; i < shared.count; ++i) {
        x[i] = at(overlap, shared.corners[i]) / w;
        highest = std::max(highest, x[i]);
      }
      if (highest < level - kTailWidths) continue;
      if (highest > level) {
        sums.scale(sums.weight > 0 ? std::exp(level - highest) : 0);
        level = highest;
      }
      for (std::size_t i = 0; i < shared.count; ++i) x[i] -= level;

      const glm::dvec3 N{-t.plane.y, -t.plane.z, 1};
      const auto on_t = [&](const glm::dvec2& uv) { return glm::dvec3{uv, at(t.plane, uv)}; };
      for (std::size_t i = 1; i + 1 < shared.count; ++i) {
        const std::array<std::size_t, 3> corner{0, i, i + 1};
        const double area2 = cross2(shared.corners[i] - shared.corners[0], shared.corners[i + 1] - shared.corners[0]);
        if (!(area2 > 0)) continue;
        double weight = 0;
        glm::dvec3 point{0};
        for (const std::size_t k : corner) {
          const double share = area2 * sorted_exp_difference<3>({x[0], x[i], x[i + 1], x[k]});
          weight += share;
          point += share * on_t(shared.corners[k]);
        }
        sums.weight += weight;
        sums.point += point;
        const glm::dvec3 turn = -glm::cross(point - weight * p_CTo_C, N);
        sums.change += spatial::to_vector6(spatial::Wrench{turn, -weight * N});
      }
      for (std::size_t i = 0; i < shared.count; ++i) {
        if (!shared.is_t[i]) continue;
        const std::size_t j = (i + 1) % shared.count;
        const glm::dvec2 along = shared.corners[j] - shared.corners[i];
        const glm::dvec3 outward{along.y, -along.x, 0};  // as long as the edge
        const double to_j = sorted_exp_difference<2>({x[i], x[j], x[j]}),
                     to_i = sorted_exp_difference<2>({x[i], x[i], x[j]});
        const glm::dvec3 moment = to_i * on_t(shared.corners[i]) + to_j * on_t(shared.corners[j]);
        const glm::dvec3 turn = w * glm::cross(moment - (to_i + to_j) * p_CTo_C, outward);
        sums.change += spatial::to_vector6(spatial::Wrench{turn, w * (to_i + to_j) * outward});
      }
    }
  }
  if (!(sums.weight > 0)) return {};
  Penetration answer;
  answer.depth_m = w * (level + std::log(sums.weight / penetration::kReferenceArea_m2));
  answer.p_CQ_C = sums.point / sums.weight;
  answer.gradient = sums.change / sums.weight;
  answer.doubts = 0;
  return answer;
}

}  // namespace farfeel::contact
