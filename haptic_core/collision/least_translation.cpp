// Overlap along a unit direction d is p(d) = max_A d.a - min_B d.b: moving B by p(d) d parts them. On the sphere of
// directions p is v.d on each cell of the Gauss map of A - B, and v.d is least at a corner of a cell, so the least
// translation is at a node: a face normal of A, minus a face normal of B, or a crossing of an arc of A with a reflected
// arc of B. When only directions at most 90 degrees from n are allowed, great circles across n cut the cells, and their
// corners join the candidates: e x n for every edge e, and n x m for two such circles.
#include <cmath>
#include <limits>

#include "haptic_core/collision/convex_pair.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;

constexpr double kGrazing = 1e-9;               // sine: arcs that miss each other by less are tried too
constexpr double kParallel = 1e-12;             // sine between edges, squared below this is no axis
constexpr double kOnBoundary = 1e-9;            // cosine: admissible within this
constexpr double kSameWay = 0.984807753012208;  // cos 10 degrees: see ProximityPair

struct Reach {
  std::uint32_t vertex;
  double along;
};

Reach farthest(const HullVertices& hull, const dvec3& d) {
  Reach best{0, -std::numeric_limits<double>::infinity()};
  for (std::uint32_t i = 0; i < hull.count; ++i) {
    const double along = hull.x[i] * d.x + hull.y[i] * d.y + hull.z[i] * d.z;
    if (along > best.along) best = {i, along};
  }
  return best;
}

double outwardness(std::span<const dvec3> outwards, const dvec3& d) {
  if (outwards.empty()) return 1;
  double best = -1;
  for (const dvec3& n : outwards) best = std::max(best, dot(n, d));
  return best;
}

class Search {
 public:
  Search(const HullShape& A, const HullShape& B) : A_(A), B_(B) {}

  // Every node of the Gauss map of A - B.
  void try_nodes() {
    for (const HullFace& f : A_.faces) consider(f.normal);
    for (const HullFace& f : B_.faces) consider(-f.normal);
    for (const HullArc& i : A_.arcs) {
      for (const HullArc& j : B_.arcs) {
        // Arc i and the reflection of arc j cross when each has its ends on both sides of the other's great circle, and
        // the crossing is not the opposite one.
        const double f = -dot(i.along, j.from), t = -dot(i.along, j.to);
        if (f * t > kGrazing) continue;
        const double g = -dot(j.along, i.from), u = -dot(j.along, i.to);
        if (g * u > kGrazing) continue;
        dvec3 d = cross(i.along, j.along);
        const double sine2 = dot(d, d);
        if (sine2 < kParallel) continue;
        if (dot(d, i.from + i.to) < 0) d = -d;
        if (dot(d, j.from + j.to) > kGrazing) continue;
        consider(d / std::sqrt(sine2));
      }
    }
  }

  // Corners that the limits of the outward cones cut out of the cells.
  void try_limits() {
    for (const std::span<const dvec3> outwards : {A_.outwards, B_.outwards}) {
      for (const dvec3& n : outwards) {
        for (const std::span<const HullArc> arcs : {A_.arcs, B_.arcs}) {
          for (const HullArc& e : arcs) consider_both(cross(e.along, n));
        }
      }
    }
    for (const dvec3& n : A_.outwards) {
      for (const dvec3& m : B_.outwards) consider_both(cross(n, m));
    }
  }

  void only_admissible() { only_admissible_ = true; }
  [[nodiscard]] bool is_admissible(const dvec3& d) const {
    return outwardness(A_.outwards, d) >= -kOnBoundary && outwardness(B_.outwards, -d) >= -kOnBoundary;
  }
  [[nodiscard]] bool faces_one_way() const {
    if (A_.outwards.empty() || B_.outwards.empty()) return false;
    for (const dvec3& n : A_.outwards) {
      for (const dvec3& m : B_.outwards) {
        if (dot(n, m) < kSameWay) return false;
      }
    }
    return true;
  }

  double depth = std::numeric_limits<double>::infinity();
  dvec3 direction{0};

 private:
  void consider(const dvec3& d) {
    if (only_admissible_ && !is_admissible(d)) return;
    const double p = farthest(A_.vertices, d).along + farthest(B_.vertices, -d).along;
    if (p < depth) depth = p, direction = d;
  }
  void consider_both(const dvec3& d) {
    const double length2 = dot(d, d);
    if (length2 < kParallel) return;
    const dvec3 unit = d / std::sqrt(length2);
    consider(unit), consider(-unit);
  }

  const HullShape &A_, &B_;
  bool only_admissible_ = false;
};

}  // namespace

LeastTranslation least_translation(const HullShape& A, const HullShape& B, double rounding_m) noexcept {
  Search search(A, B);
  search.try_nodes();
  bool admissible = search.is_admissible(search.direction);
  if (!admissible && !search.faces_one_way()) {
    Search restricted(A, B);
    restricted.only_admissible();
    restricted.try_nodes();
    restricted.try_limits();
    if (restricted.depth < std::numeric_limits<double>::infinity()) {
      search.depth = restricted.depth, search.direction = restricted.direction;
      admissible = true;
    }
  }
  LeastTranslation result{search.depth, search.direction, dvec3(0), dvec3(0), admissible};
  // Witnesses: part the hulls a little more than they need, and take their nearest points.
  const dvec3 d = search.direction;
  const Reach a = farthest(A.vertices, d), b = farthest(B.vertices, -d);
  const double gap = std::max(std::abs(search.depth), 1e6 * rounding_m);
  PairSimplex simplex{1, {a.vertex}, {b.vertex}};
  const Separation apart = separation(A.vertices, B.vertices, (search.depth + gap) * d,
                                      std::numeric_limits<double>::infinity(), rounding_m, simplex);
  if (apart.apartness == Apartness::kApart) result.p_a = apart.p_a, result.p_b = apart.p_b;
  const double error = dot(result.p_a - result.p_b, d) - search.depth;
  if (apart.apartness != Apartness::kApart || std::abs(error) > 1e-6 * gap) {
    result.p_a = A.vertices.at(a.vertex), result.p_b = B.vertices.at(b.vertex);
  } else {
    result.p_a -= error * d;
  }
  return result;
}

}  // namespace farfeel::collision
