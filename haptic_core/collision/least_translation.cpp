// Overlap along a unit direction d is p(d) = max_A d.a - min_B d.b: moving B by p(d) d parts them. On the sphere of
// directions p is v.d on each region in which one vertex pair v = a - b is outermost, and v.d is least at the region's
// corners. So the least translation is found at a face normal of A, at a reversed face normal of B, or where an edge's
// arc of A crosses a reversed arc of B.
//
// Most of it is never looked at. With any b in B, max_A d.a - d.b bounds p(d) from below, and on an arc of A that bound
// is least at one of the ends. So a face is out when some vertex of the other hull takes its bound to the best overlap
// found so far, and an edge when one vertex does so for both its faces. Started from the last answer, little is left.
//
// Restricted to the outward cones it is the same search over the outward maps: see outward_map.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_support.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;
using Kind = TranslationAxis::Kind;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGrazing = 1e-9;               // sine: arcs that miss each other by less are tried too
constexpr double kParallel = 1e-12;             // sine, squared: edges more parallel than a microradian have no axis
constexpr double kOnBoundary = 1e-9;            // cosine: admissible within this
constexpr double kSameWay = 0.984807753012208;  // cos 10 degrees: see ProximityPair
constexpr std::size_t kMostFaces = 64;          // whose bounds are remembered
constexpr std::size_t kMostEdges = 256;         // that may survive; more, and all are taken as they come

double outwardness(std::span<const dvec3> outwards, const dvec3& d) {
  if (outwards.empty()) return 1;
  double best = -1;
  for (const dvec3& n : outwards) best = std::max(best, dot(n, d));
  return best;
}

bool is_admissible(const HullShape& A, const HullShape& B, const dvec3& d) {
  return outwardness(A.outwards, d) >= -kOnBoundary && outwardness(B.outwards, -d) >= -kOnBoundary;
}

// Then no direction leads out of both by more than a graze.
bool face_one_way(const HullShape& A, const HullShape& B) {
  if (A.outwards.empty() || B.outwards.empty()) return false;
  for (const dvec3& n : A.outwards) {
    for (const dvec3& m : B.outwards) {
      if (dot(n, m) < kSameWay) return false;
    }
  }
  return true;
}

bool on_arc(const HullEdge& e, const dvec3& d, double grazing) {
  return dot(e.limits[0], d) >= -grazing && dot(e.limits[1], d) >= -grazing;
}

class Search {
 public:
  Search(const HullShape& a_shape, const HullShape& b_shape, bool admissible)
      : A(a_shape),
        B(b_shape),
        only_admissible(admissible),
        faces_a(admissible ? A.faces.first(A.outward_faces) : A.faces),
        faces_b(admissible ? B.faces.first(B.outward_faces) : B.faces),
        edges_a(admissible ? A.edges.first(A.outward_edges) : A.edges),
        edges_b(admissible ? B.edges.first(B.outward_edges) : B.edges) {}

  void run(const TranslationAxis& guess) {
    try_guess(guess);
    FaceBounds of_a, of_b;
    try_faces(true, of_a);
    try_faces(false, of_b);
    Survivors edges_of_a, edges_of_b;
    keep_edges(true, of_a, edges_of_a);
    keep_edges(false, of_b, edges_of_b);
    for (std::uint32_t i = 0; i < edges_of_a.count; ++i) {
      for (std::uint32_t j = 0; j < edges_of_b.count; ++j) try_edges(edges_of_a[i], edges_of_b[j]);
    }
  }

  HullShape A, B;
  bool only_admissible;
  std::span<const HullFace> faces_a, faces_b;
  std::span<const HullEdge> edges_a, edges_b;
  double depth = kInfinity;
  dvec3 direction{0};
  Reach a{}, b{};  // outermost along direction, and along its reverse
  TranslationAxis axis{};

 private:
  void consider(const dvec3& d, const TranslationAxis& from) {
    if (only_admissible && !is_admissible(A, B, d)) return;
    const Reach of_a = farthest(A.vertices, d), of_b = farthest(B.vertices, -d);
    const double p = of_a.along_m + of_b.along_m;
    if (p < depth) depth = p, direction = d, a = of_a, b = of_b, axis = from;
  }

  // Where the last answer was found, if that still is a candidate.
  void try_guess(const TranslationAxis& guess) {
    switch (guess.kind) {
      case Kind::kFaceOfA:
        return consider(A.faces[guess.a].normal, guess);
      case Kind::kFaceOfB:
        return consider(-B.faces[guess.b].normal, guess);
      case Kind::kEdges:
        return try_edges(guess.a, guess.b);
      default:
        return;
    }
  }

  // Lower bounds of p at the faces of one hull, all from one fixed vertex of the other, and the other's outermost
  // vertex against each face that this bound did not rule out.
  struct FaceBounds {
    std::array<double, kMostFaces> by_fixed;
    std::array<std::uint32_t, kMostFaces> outermost;
  };

  void try_faces(bool of_a, FaceBounds& bounds) {
    const std::span<const HullFace> faces = of_a ? faces_a : faces_b;
    const HullVertices& other = of_a ? B.vertices : A.vertices;
    const dvec3 fixed = other.at(of_a ? b.vertex : a.vertex);
    for (std::uint32_t i = 0; i < faces.size(); ++i) {
      const HullFace& face = faces[i];
      const double by_fixed = bound(face, fixed);
      const bool is_kept = i < kMostFaces;
      if (is_kept) bounds.by_fixed[i] = by_fixed;
      if (by_fixed >= depth) continue;
      const Reach reach = farthest(other, -face.normal);
      if (is_kept) bounds.outermost[i] = reach.vertex;
      const double p = face.offset_m + reach.along_m;
      if (p >= depth) continue;
      const dvec3 d = of_a ? face.normal : -face.normal;
      if (only_admissible && !is_admissible(A, B, d)) continue;
      depth = p, direction = d;
      a = of_a ? farthest(A.vertices, d) : reach;
      b = of_a ? reach : farthest(B.vertices, -d);
      axis = of_a ? TranslationAxis{Kind::kFaceOfA, i, 0} : TranslationAxis{Kind::kFaceOfB, 0, i};
    }
  }

  static double bound(const HullFace& face, const dvec3& other) { return face.offset_m - dot(face.normal, other); }

  struct Survivors {
    std::array<std::uint32_t, kMostEdges> edges;
    std::uint32_t count = 0;
    bool are_all = false;
    [[nodiscard]] std::uint32_t operator[](std::uint32_t i) const { return are_all ? i : edges[i]; }
  };

  // Edges whose arc no single vertex of the other hull rules out.
  void keep_edges(bool of_a, const FaceBounds& bounds, Survivors& kept) const {
    const std::span<const HullFace> faces = of_a ? A.faces : B.faces;
    const std::span<const HullEdge> edges = of_a ? edges_a : edges_b;
    const std::size_t tried = std::min((of_a ? faces_a : faces_b).size(), kMostFaces);
    const HullVertices& other = of_a ? B.vertices : A.vertices;
    const auto rules_out = [&](std::uint32_t vertex, const HullEdge& e) {
      const dvec3 v = other.at(vertex);
      return bound(faces[e.faces[0]], v) >= depth && bound(faces[e.faces[1]], v) >= depth;
    };
    const auto is_out = [&](const HullEdge& e) {
      const auto [f, g] = e.faces;
      if (f == g) return false;  // a segment's circle has no ends
      if (f >= tried || g >= tried) return rules_out(of_a ? b.vertex : a.vertex, e);
      const bool f_is_out = bounds.by_fixed[f] >= depth, g_is_out = bounds.by_fixed[g] >= depth;
      if (f_is_out && g_is_out) return true;
      return (!f_is_out && rules_out(bounds.outermost[f], e)) || (!g_is_out && rules_out(bounds.outermost[g], e));
    };
    for (std::uint32_t i = 0; i < edges.size(); ++i) {
      if (is_out(edges[i])) continue;
      if (kept.count == kMostEdges) {
        kept.are_all = true, kept.count = std::uint32_t(edges.size());
        return;
      }
      kept.edges[kept.count++] = i;
    }
  }

  void try_edges(std::uint32_t i, std::uint32_t j) {
    const HullEdge &e = A.edges[i], &f = B.edges[j];
    const dvec3 c = cross(e.along, f.along);
    const double sine2 = dot(c, c);
    const double s = dot(A.vertices.at(e.ends[0]) - B.vertices.at(f.ends[0]), c);
    if (s * s >= depth * depth * sine2 || sine2 < kParallel) return;
    for (const double sign : {1.0, -1.0}) {
      const dvec3 d = sign * c;
      if (!on_arc(e, d, kGrazing) || !on_arc(f, -d, kGrazing)) continue;
      consider(d / std::sqrt(sine2), {Kind::kEdges, i, j});
    }
  }
};

// The two vertices' heights along the direction are right whatever the axis; across it the witnesses are taken from the
// features that met: a vertex over a face, or the two edges' common perpendicular.
void place_witnesses(const Search& search, LeastTranslation& result) {
  const HullShape &A = search.A, &B = search.B;
  const dvec3 d = result.direction;
  switch (search.axis.kind) {
    case Kind::kFaceOfA:
      result.p_b = B.vertices.at(search.b.vertex);
      result.p_a = result.p_b + result.depth_m * d;
      return;
    case Kind::kFaceOfB:
      result.p_a = A.vertices.at(search.a.vertex);
      result.p_b = result.p_a - result.depth_m * d;
      return;
    case Kind::kEdges: {
      const HullEdge &e = A.edges[search.axis.a], &f = B.edges[search.axis.b];
      const dvec3 c = cross(e.along, f.along), p = A.vertices.at(e.ends[0]);
      const double t = dot(cross(B.vertices.at(f.ends[0]) - p, f.along), c) / dot(c, c);
      result.p_a = p + t * e.along;
      result.p_b = result.p_a - result.depth_m * d;
      return;
    }
    default:
      result.p_a = A.vertices.at(search.a.vertex);
      result.p_b = B.vertices.at(search.b.vertex);
  }
}

}  // namespace

FARFEEL_WIDE_VECTORS
LeastTranslation least_translation(const HullShape& A, const HullShape& B, TranslationAxis& guess) noexcept {
  Search search(A, B, !face_one_way(A, B));
  search.run(guess);
  if (search.depth == kInfinity) {  // by rounding only
    search = Search(A, B, false);
    search.run({});
  }
  guess = search.axis;
  LeastTranslation result{search.depth, search.direction, dvec3(0), dvec3(0), true};
  if (!search.only_admissible) result.is_admissible = is_admissible(A, B, search.direction);
  place_witnesses(search, result);
  return result;
}

}  // namespace farfeel::collision
