// Overlap along a unit direction d is p(d) = max_A d.a - min_B d.b: moving B by p(d) d parts them. On the sphere of
// directions p is v.d on each region in which one vertex pair v = a - b is outermost, and v.d is least at the region's
// corners. So the least translation is found at a face normal of A, at a reversed face normal of B, or where an edge's
// arc of A crosses a reversed arc of B.
//
// Most of it is never looked at. With a_c in A and b_c in B, h_A(d) - d.b_c and d.a_c + h_B(-d) bound p(d) from below;
// on an arc they are least at its ends. So a face whose bound reaches the best overlap found so far is out, and an edge
// between two such faces too. Started from the last answer's direction and its two outermost vertices, little is left.
//
// Restricted to the outward cones it is the same search over the outward maps: see outward_map.h.
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
    try_faces();
    try_edge_pairs();
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

  void try_faces() {
    for (std::uint32_t i = 0; i < faces_a.size(); ++i) {
      if (bound(faces_a[i], B.vertices.at(b.vertex)) < depth) consider(faces_a[i].normal, {Kind::kFaceOfA, i, 0});
    }
    for (std::uint32_t j = 0; j < faces_b.size(); ++j) {
      if (bound(faces_b[j], A.vertices.at(a.vertex)) < depth) consider(-faces_b[j].normal, {Kind::kFaceOfB, 0, j});
    }
  }

  static double bound(const HullFace& face, const dvec3& other) { return face.offset_m - dot(face.normal, other); }

  void try_edges(std::uint32_t i, std::uint32_t j) {
    const HullEdge &e = edges_a[i], &f = edges_b[j];
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

  struct Survivors {
    std::array<std::uint32_t, kMostEdges> edges;
    std::uint32_t count = 0;
    bool are_all = false;
  };

  void keep_edges(Survivors& kept, std::span<const HullFace> faces, std::span<const HullEdge> edges,
                  const dvec3& other) const {
    for (std::uint32_t i = 0; i < edges.size(); ++i) {
      const HullEdge& e = edges[i];
      const bool is_arc = e.limits[0] != dvec3(0);  // a segment's circle has no ends
      if (is_arc && bound(faces[e.faces[0]], other) >= depth && bound(faces[e.faces[1]], other) >= depth) continue;
      if (kept.count == kMostEdges) {
        kept.are_all = true;
        return;
      }
      kept.edges[kept.count++] = i;
    }
  }

  void try_edge_pairs() {
    Survivors of_a, of_b;
    keep_edges(of_a, A.faces, edges_a, B.vertices.at(b.vertex));
    keep_edges(of_b, B.faces, edges_b, A.vertices.at(a.vertex));
    const std::size_t n = of_a.are_all ? edges_a.size() : of_a.count, m = of_b.are_all ? edges_b.size() : of_b.count;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < m; ++j) {
        try_edges(of_a.are_all ? i : of_a.edges[i], of_b.are_all ? j : of_b.edges[j]);
      }
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
      const HullEdge &e = search.edges_a[search.axis.a], &f = search.edges_b[search.axis.b];
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
