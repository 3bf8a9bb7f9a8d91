#include "haptic_core/collision/overlap_witnesses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "haptic_core/collision/hull_support.h"
#include "haptic_core/counting/work.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;
using Feature = HullFeature::Kind;

constexpr std::size_t kMost = 32;    ///< vertices or edges of a face; of one with more, a part will do
constexpr double kRounding = 1e-12;  ///< of the coordinates' size: nearer is the same

/// The vertex of a hull that lies farthest along d, and the largest coordinate of all vertices.
FARFEEL_WIDE_VECTORS Reach farthest_and_size(const HullVertices& hull, const dvec3& d, double& size) noexcept {
  Four most = {0, 0, 0, 0}, x;
  for (const double* coordinates : {hull.x, hull.y, hull.z}) {
    for (std::uint32_t i = 0; i < hull.count; i += 4) {
      load_four(x, coordinates + i);
      const Four there = x < 0 ? -x : x;
      most = there > most ? there : most;
    }
  }
  size = std::max({most[0], most[1], most[2], most[3]});
  return farthest(hull, d);
}

/// The vertices of a hull that reach as far along a direction as any, and the edges between them: a vertex, an edge or
/// a face.
struct Outermost {
  /// at: the vertices in A's frame, as is `along`; along_own: the direction in the shape's own frame.
  Outermost(const HullShape& hull, const HullVertices& at, const dvec3& d, const dvec3& d_own)
      : shape(hull), vertices_at(at), along(d), along_own(d_own) {
    double size = 0;
    const Reach first = farthest_and_size(at, d, size);
    same_m = kRounding * size;
    const double least_m = first.along_m - same_m;
    counting::count(Work::kWitnessLooks, at.count);
    if (!gather_from(first.vertex, least_m)) gather_all(least_m);
    if (count > 1 && !knows_edges) look_through_edges(least_m);
    if (!is_face()) return;
    for (std::uint32_t k = 0; k < count; ++k) middle += at.at(vertices[k]) / static_cast<double>(count);
  }

  [[nodiscard]] bool is_face() const { return edge_count >= 3 && edge_count == count; }

  /// How many edges there are to look at: a vertex counts as one without length.
  [[nodiscard]] std::uint32_t sides() const { return std::max(edge_count, 1u); }
  [[nodiscard]] std::array<dvec3, 2> ends(std::uint32_t side) const {
    if (edge_count == 0) return {vertices_at.at(vertices[0]), vertices_at.at(vertices[0])};
    const auto& [a, b] = shape.edges[edges[side]].ends;
    return {vertices_at.at(a), vertices_at.at(b)};
  }
  [[nodiscard]] HullFeature feature(std::uint32_t side) const {
    return edge_count == 0 ? HullFeature{Feature::kVertex, vertices[0]} : HullFeature{Feature::kEdge, edges[side]};
  }
  /// Whether a place of their plane is on what they make, and, for who asks, on which feature of the hull it is then.
  [[nodiscard]] bool holds(const dvec3& p, HullFeature* on = nullptr) const {
    if (!is_face()) {
      for (std::uint32_t k = 0; k < sides(); ++k) {
        const auto [a, b] = ends(k);
        const dvec3 e = b - a;
        const double square = dot(e, e), share = square > 0 ? std::clamp(dot(p - a, e) / square, 0.0, 1.0) : 0.0;
        if (glm::distance(p, a + share * e) > same_m) continue;
        if (on) *on = feature(k);
        return true;
      }
      return false;
    }
    for (std::uint32_t k = 0; k < edge_count; ++k) {
      const auto [a, b] = ends(k);
      const dvec3 across = cross(along, b - a), inwards = dot(across, middle - a) > 0 ? across : -across;
      if (dot(inwards, p - a) < -same_m * glm::length(inwards)) return false;
    }
    if (!on) return true;
    *on = {Feature::kFace, 0};
    double most = -std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < shape.faces.count; ++i) {
      if (const double there = dot(shape.faces.normal(i), along_own); there > most) most = there, on->index = i;
    }
    return true;
  }

  [[nodiscard]] bool reaches(std::uint32_t v, double least_m) const { return dot(vertices_at.at(v), along) >= least_m; }
  [[nodiscard]] std::span<const std::uint32_t> edges_of(std::uint32_t v) const {
    return {shape.edges_at + shape.edges_at[v], shape.edges_at + shape.edges_at[v + 1]};
  }
  /// What reaches farthest on a convex hull hangs together along its edges. False: there is more of it than kMost, or
  /// the hull has no edges. Arcs of an outward map's rim stand at one vertex, which does not know of them: where there
  /// are any, the edges remain to be looked through.
  bool gather_from(std::uint32_t first, double least_m) {
    if (shape.edges.empty() || edges_of(first).empty()) return false;
    const std::uint32_t all = shape.edges_at[0] - 1, known = shape.edges_at[all] - shape.edges_at[0];
    knows_edges = known == 2 * shape.edges.size();
    vertices[count++] = first;
    for (std::uint32_t k = 0; k < count; ++k) {
      counting::count(Work::kWitnessLooks, edges_of(vertices[k]).size());
      for (const std::uint32_t e : edges_of(vertices[k])) {
        const auto& [a, b] = shape.edges[e].ends;
        const std::uint32_t other = a == vertices[k] ? b : a;
        if (!reaches(other, least_m)) continue;
        if (knows_edges && a == vertices[k] && edge_count < kMost) edges[edge_count++] = e;
        if (std::find(vertices.begin(), vertices.begin() + count, other) != vertices.begin() + count) continue;
        if (count == kMost) return false;
        vertices[count++] = other;
      }
    }
    std::sort(vertices.begin(), vertices.begin() + count);
    std::sort(edges.begin(), edges.begin() + edge_count);
    return true;
  }
  void gather_all(double least_m) {
    counting::count(Work::kWitnessLooks, vertices_at.count);
    count = 0, knows_edges = false;
    for (std::uint32_t v = 0; v < vertices_at.count && count < kMost; ++v) {
      const bool is_padding = v > 0 && vertices_at.at(v) == vertices_at.at(v - 1);
      if (!is_padding && reaches(v, least_m)) vertices[count++] = v;
    }
  }
  /// Of all edges those that reach as far at both ends.
  void look_through_edges(double least_m) {
    counting::count(Work::kWitnessLooks, shape.edges.size());
    edge_count = 0;
    for (std::uint32_t e = 0; e < shape.edges.size() && edge_count < kMost; ++e) {
      const auto& [a, b] = shape.edges[e].ends;
      if (reaches(a, least_m) && reaches(b, least_m)) edges[edge_count++] = e;
    }
  }

  const HullShape& shape;
  const HullVertices& vertices_at;
  dvec3 along, along_own, middle{0};  ///< middle: of a face
  double same_m = 0;
  std::array<std::uint32_t, kMost> vertices, edges;  ///< the first `count` and `edge_count`, by rising numbers
  std::uint32_t count = 0, edge_count = 0;
  bool knows_edges = false;  ///< each vertex knows its edges, so they are gathered with it
};

/// Shares of two edges from a to a + u and from b to b + v, for the places that are nearest to each other; w = a - b.
/// Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
std::array<double, 2> nearest_shares(const dvec3& u, const dvec3& v, const dvec3& w) {
  const auto share = [](double x) { return std::clamp(x, 0.0, 1.0); };
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  if (uu == 0) return {0, vv > 0 ? share(vw / vv) : 0};
  if (vv == 0) return {share(-uw / uu), 0};
  constexpr double kParallel = 1e-12;  // sine, squared: side by side, any place along both is as near
  const double area = uu * vv - uv * uv;
  const double s = area > kParallel * uu * vv ? share((uv * vw - vv * uw) / area) : 0, t = (uv * s + vw) / vv;
  if (t >= 0 && t <= 1) return {s, t};
  return {share((uv * share(t) - uw) / uu), share(t)};
}

}  // namespace

void keep_on_hulls(const PlacedPair& pair, LeastTranslation& found) noexcept {
  const dvec3 d = found.direction, through = found.depth_m * d;
  const Outermost a(pair.A, pair.A.vertices, d, d), b(pair.B, pair.b_in_A, -d, -(d * pair.X_AB.R));
  if (a.holds(found.p_a) && b.holds(found.p_b)) return;
  for (std::uint32_t k = 0; k < b.count; ++k) {
    const dvec3 p = pair.b_in_A.at(b.vertices[k]);
    if (!a.holds(p + through, &found.feature_a)) continue;
    found.p_a = p + through, found.p_b = p;
    found.feature_b = {Feature::kVertex, b.vertices[k]};
    return;
  }
  for (std::uint32_t k = 0; k < a.count; ++k) {
    const dvec3 p = pair.A.vertices.at(a.vertices[k]);
    if (!b.holds(p - through, &found.feature_b)) continue;
    found.p_a = p, found.p_b = p - through;
    found.feature_a = {Feature::kVertex, a.vertices[k]};
    return;
  }
  // No corner of the one is over the other: their edges cross, or they lie beside each other.
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < a.sides(); ++i) {
    const auto [a_0, a_1] = a.ends(i);
    for (std::uint32_t j = 0; j < b.sides(); ++j) {
      const auto [b_0, b_1] = b.ends(j);
      const dvec3 u = a_1 - a_0, v = b_1 - b_0, w = a_0 - b_0 - through;
      const auto [s, t] = nearest_shares(u, v, w);
      const dvec3 apart = w + s * u - t * v;
      if (!(dot(apart, apart) < least)) continue;
      least = dot(apart, apart);
      found.p_a = a_0 + s * u, found.p_b = b_0 + t * v;
      found.feature_a = a.feature(i), found.feature_b = b.feature(j);
    }
  }
}

}  // namespace farfeel::collision
