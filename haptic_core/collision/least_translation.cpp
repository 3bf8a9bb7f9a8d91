// Overlap along a unit direction d is p(d) = max_A d.a - min_B d.b: moving B by p(d) d parts them. On the sphere of
// directions p is v.d on each region in which one vertex pair v = a - b is outermost, and v.d is least at the region's
// corners. So the least translation is found at a face normal of A, at a reversed face normal of B, or where an edge's
// arc of A crosses a reversed arc of B.
//
// Most of it is never looked at. With any b in B, max_A d.a - d.b bounds p(d) from below, and on an arc of A that bound
// is least at one of the ends. So an edge is out when some vertex of the other hull takes the bounds of both its faces
// to the best overlap found so far. Every face meets every vertex once, four faces at a time: the largest bound of a
// face is its p, and which vertices took it to the best is a word of bits, so that two faces' words rule an edge out.
// Started from the last answer, few edges are left.
//
// Restricted to the outward cones it is the same search over the outward maps: see outward_map.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_support.h"
#include "haptic_core/collision/overlap_witnesses.h"
#include "haptic_core/counting/work.h"

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;
using Kind = TranslationAxis::Kind;
using Feature = HullFeature::Kind;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGrazing = 1e-9;               // sine: arcs that miss each other by less are tried too
constexpr double kParallel = 1e-12;             // sine, squared: edges more parallel than a microradian have no axis
constexpr double kOnBoundary = 1e-9;            // cosine: admissible within this
constexpr double kSameWay = 0.984807753012208;  // cos 10 degrees: see ProximityPair
constexpr double kSameDepth = 1e-12;            // of the depth: less is rounding
constexpr std::uint32_t kSmall = 16, kMostSmallFaces = 64;  // vertices, faces: all of one meet all of the other
constexpr int kMostDescents = 8;
constexpr std::uint32_t kMostWitnesses = 64;  // vertices that rule out: the bits of a word

// Then no direction leads out of both by more than a graze.
bool face_one_way(const PlacedPair& pair) {
  if (pair.A.outwards.count == 0 || pair.B.outwards.count == 0) return false;
  for (std::uint32_t k = 0; k < pair.A.outwards.count; ++k) {
    const double least = -reach_along(pair.B.outwards, -(pair.A.outwards.at(k) * pair.X_AB.R));
    if (least < kSameWay) return false;
  }
  return true;
}

bool on_arc(const HullEdge& e, const dvec3& d, double grazing) {
  return dot(e.limits[0], d) >= -grazing && dot(e.limits[1], d) >= -grazing;
}

// p along a face's normal: how far the other hull reaches behind its plane. The same bits as look() finds.
double overlap_behind(const HullFaces& faces, std::uint32_t i, const HullVertices& other) {
  return faces.offset_m[i] + reach_along(other, -faces.normal(i));
}

// p along four faces' normals, and for each the vertices (bit v) that are at least `enough` behind it.
struct FourFaces {
  Four x, y, z, offset, most;
  FourIndices bits{};
  [[gnu::always_inline]] FourFaces(const HullFaces& f, std::uint32_t i) {
    load_four(x, f.x + i), load_four(y, f.y + i), load_four(z, f.z + i), load_four(offset, f.offset_m + i);
    most = Four{} - kInfinity;
  }
  [[gnu::always_inline]] void meet(double px, double py, double pz, double enough, const FourIndices& bit) {
    const Four behind = offset - (x * px + y * py + z * pz);
    bits |= (behind >= enough) & bit;
    most = behind > most ? behind : most;
  }
  [[gnu::always_inline]] void store(double* overlap_m, std::uint64_t* out) const {
    store_four(overlap_m, most);
    std::memcpy(out, &bits, sizeof bits);
  }
};

/// Unsigned, for after 64 vertices there is none left.
[[gnu::always_inline]] inline void go_to_next(FourIndices& bit) {
  using FourBits [[gnu::vector_size(32)]] = std::uint64_t;
  FourBits bits;
  std::memcpy(&bits, &bit, sizeof bits);
  bits += bits;
  std::memcpy(&bit, &bits, sizeof bits);
}

// The same for all faces, eight at a time.
[[gnu::always_inline]] inline void look(const HullFaces& faces, const HullVertices& other, double enough,
                                        double* overlap_m, std::uint64_t* out) {
  std::uint32_t i = 0;
  for (; i + 4 < faces.count; i += 8) {
    FourFaces first(faces, i), second(faces, i + 4);
    FourIndices bit = {1, 1, 1, 1};
    for (std::uint32_t v = 0; v < other.count; ++v, go_to_next(bit)) {
      first.meet(other.x[v], other.y[v], other.z[v], enough, bit);
      second.meet(other.x[v], other.y[v], other.z[v], enough, bit);
    }
    first.store(overlap_m + i, out + i), second.store(overlap_m + i + 4, out + i + 4);
  }
  if (i == faces.count) return;
  FourFaces last(faces, i);
  FourIndices bit = {1, 1, 1, 1};
  for (std::uint32_t v = 0; v < other.count; ++v, go_to_next(bit)) {
    last.meet(other.x[v], other.y[v], other.z[v], enough, bit);
  }
  last.store(overlap_m + i, out + i);
}

class Search {
 public:
  Search(const PlacedPair& p, bool admissible, double enough, TranslationScratch& s)
      : pair(p), A(p.A), B(p.B), only_admissible(admissible), enough_m(enough), scratch(s) {}

  void run(const TranslationAxis& guess) {
    try_guess(guess);
    if (depth <= enough_m) return;
    const bool is_cold = depth == kInfinity;
    look_at_faces(true), look_at_faces(false);
    if (depth <= enough_m) return;
    if (is_cold) look_at_faces(true), look_at_faces(false);  // now that there is something to compare with
    const std::uint32_t of_a = keep_edges(A, scratch.out_a, scratch.edges_a);
    const std::uint32_t of_b = keep_edges(B, scratch.out_b, scratch.edges_b);
    try_crossings({scratch.edges_a.data(), of_a}, {scratch.edges_b.data(), of_b});
  }

  // Where the last answer was found, if that still is a candidate.
  void try_guess(const TranslationAxis& guess) {
    switch (guess.kind) {
      case Kind::kFaceOfA:
        return take_face(true, guess.a, overlap_behind(A.faces, guess.a, pair.b_in_A));
      case Kind::kFaceOfB:
        return take_face(false, guess.b, overlap_behind(B.faces, guess.b, pair.a_in_B));
      case Kind::kEdges:
        return try_edges(guess.a, line_of_b(guess.b));
      default:
        return;
    }
  }

  // An edge of B, in A's frame.
  struct LineOfB {
    std::uint32_t edge;
    dvec3 along, point;
  };
  [[nodiscard]] LineOfB line_of_b(std::uint32_t j) const {
    return {j, pair.X_AB.R * B.edges[j].along, pair.b_in_A.at(B.edges[j].ends[0])};
  }
  [[nodiscard]] bool is_admissible(const dvec3& d) const {
    return outwardness(A.outwards, d) >= -kOnBoundary && outwardness(B.outwards, -(d * pair.X_AB.R)) >= -kOnBoundary;
  }

  const PlacedPair& pair;
  const HullShape &A, &B;
  bool only_admissible;
  double enough_m;
  double depth = kInfinity;
  dvec3 direction{0};
  TranslationAxis axis{};

 private:
  TranslationScratch& scratch;

  void take(double p, const dvec3& d, const TranslationAxis& from) {
    if (p >= depth || (only_admissible && !is_admissible(d))) return;
    depth = p, direction = d, axis = from;
  }
  void take_face(bool of_a, std::uint32_t i, double p) {
    if (of_a) return take(p, A.faces.normal(i), {Kind::kFaceOfA, i, 0});
    take(p, -(pair.X_AB.R * B.faces.normal(i)), {Kind::kFaceOfB, 0, i});
  }

  void look_at_faces(bool of_a) {
    const HullShape& shape = of_a ? A : B;
    const HullVertices& other = of_a ? pair.b_in_A : pair.a_in_B;
    std::uint64_t* out = of_a ? scratch.out_a.data() : scratch.out_b.data();
    counting::count(Work::kFaces, shape.faces.count);
    const std::uint32_t faces = only_admissible ? shape.outward_faces : shape.faces.count;
    if (other.count > kSmall || shape.faces.count > kMostSmallFaces) {
      return look_at_big(of_a, shape.faces, faces, other, out);
    }
    look(shape.faces, other, depth, scratch.overlap_m.data(), out);
    for (std::uint32_t i = 0; i < faces; ++i) {
      if (scratch.overlap_m[i] < depth) take_face(of_a, i, scratch.overlap_m[i]);
    }
  }

  // Without a guess: a few steps from a vertex to the face that it is least behind, and on to the vertex that reaches
  // farthest behind that one.
  void descend(bool of_a, const HullFaces& faces, std::uint32_t count, const HullVertices& other) {
    std::uint32_t vertex = 0;
    for (int step = 0; step < kMostDescents; ++step) {
      std::uint32_t best = 0;
      double least = kInfinity;
      for (std::uint32_t i = 0; i < count; ++i) {
        const double behind = faces.offset_m[i] - dot(faces.normal(i), other.at(vertex));
        if (behind < least) least = behind, best = i;
      }
      const Reach reach = farthest(other, -faces.normal(best));
      take_face(of_a, best, faces.offset_m[best] + reach.along_m);
      if (reach.vertex == vertex) return;
      vertex = reach.vertex;
    }
  }

  // The same for big hulls: against the one vertex that reaches farthest along the best direction so far, which rules
  // out most faces; then, for the others, against those that reach farthest behind them.
  void look_at_big(bool of_a, const HullFaces& faces, std::uint32_t count, const HullVertices& other,
                   std::uint64_t* out) {
    std::array<double, kMostWitnesses> x, y, z;
    HullVertices few{x.data(), y.data(), z.data(), 0};
    const auto add_witness = [&](std::uint32_t vertex) {
      if (few.count == kMostWitnesses) return;
      const dvec3 p = other.at(vertex);
      x[few.count] = p.x, y[few.count] = p.y, z[few.count] = p.z, ++few.count;
    };
    if (depth == kInfinity) descend(of_a, faces, count, other);
    const dvec3 into_other = of_a ? -direction : direction * pair.X_AB.R;
    add_witness(depth < kInfinity ? farthest(other, into_other).vertex : 0);
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < faces.count; i += 4) {
      const HullFaces four{faces.x + i, faces.y + i, faces.z + i, faces.offset_m + i, 4};
      look(four, {x.data(), y.data(), z.data(), 1}, depth, &scratch.overlap_m[i], &out[i]);
      if ((out[i] & out[i + 1] & out[i + 2] & out[i + 3]) != 0) continue;
      scratch.faces_left[left++] = i;
      for (std::uint32_t k = i; k < std::min(i + 4, count); ++k) {
        if (scratch.overlap_m[k] >= depth) continue;
        const Reach reach = farthest(other, -faces.normal(k));
        take_face(of_a, k, faces.offset_m[k] + reach.along_m);
        add_witness(reach.vertex);
      }
    }
    for (std::uint32_t k = 0; k < left; ++k) {
      const std::uint32_t i = scratch.faces_left[k];
      const HullFaces four{faces.x + i, faces.y + i, faces.z + i, faces.offset_m + i, 4};
      look(four, few, depth, &scratch.overlap_m[i], &out[i]);
    }
  }

  // Edges whose arc no single vertex of the other hull rules out.
  std::uint32_t keep_edges(const HullShape& shape, const std::vector<std::uint64_t>& out,
                           std::vector<std::uint32_t>& kept) const {
    const std::size_t edges = only_admissible ? shape.outward_edges : shape.edges.size();
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < edges; ++i) {
      const auto [f, g] = shape.edge_faces[i];
      kept[count] = i;
      count += (out[f] & out[g]) == 0 || f == g;  // a segment's circle has no ends
    }
    return count;
  }

  // Overlap along the edges' common perpendicular c is |s| / |c|, with s = v.c for any v from one to the other.
  void try_edges(std::uint32_t i, const LineOfB& f) {
    const HullEdge& e = A.edges[i];
    const dvec3 c = cross(e.along, f.along);
    const double sine2 = dot(c, c), s = dot(A.vertices.at(e.ends[0]) - f.point, c);
    if (s * s >= depth * depth * sine2 || sine2 < kParallel) return;
    const dvec3 c_b = c * pair.X_AB.R;
    for (const double sign : {1.0, -1.0}) {
      if (!on_arc(e, sign * c, kGrazing) || !on_arc(B.edges[f.edge], -sign * c_b, kGrazing)) continue;
      const dvec3 d = c * (sign / std::sqrt(sine2));
      if (only_admissible && !is_admissible(d)) continue;
      take(reach_of_both(A.vertices, pair.b_in_A, d), d, {Kind::kEdges, i, f.edge});
    }
  }

  // Up to kBlock edges of B, as columns and, at last, in A's frame: direction, a point, and the arc's two limits.
  static constexpr std::size_t kBlock = 16;
  struct EdgeBlock {
    std::array<std::array<double, kBlock>, 12> column;
    void set(std::size_t k, const HullEdge& e, const dvec3& point) {
      const std::array<dvec3, 4> of{e.along, point, e.limits[0], e.limits[1]};
      for (std::size_t i = 0; i < 12; ++i) column[i][k] = of[i / 3][int(i % 3)];
    }
    [[gnu::always_inline]] void load(FourVectors& v, std::size_t vector, std::size_t k) const {
      load_four(v.x, &column[3 * vector][k]), load_four(v.y, &column[3 * vector + 1][k]);
      load_four(v.z, &column[3 * vector + 2][k]);
    }
    [[gnu::always_inline]] void turn(std::size_t vector, std::size_t k, const glm::dmat3& R) {
      FourVectors v;
      load(v, vector, k);
      store_four(&column[3 * vector][k], R[0].x * v.x + R[1].x * v.y + R[2].x * v.z);
      store_four(&column[3 * vector + 1][k], R[0].y * v.x + R[1].y * v.y + R[2].y * v.z);
      store_four(&column[3 * vector + 2][k], R[0].z * v.x + R[1].z * v.y + R[2].z * v.z);
    }
  };

  // Every edge of A with every edge of B, four of B at a time: those whose arcs cross below the least so far.
  void try_crossings(std::span<const std::uint32_t> of_a, std::span<const std::uint32_t> of_b) {
    counting::count(Work::kEdgePairs, of_a.size() * of_b.size());
    EdgeBlock block;
    const double below = depth * (1 - kSameDepth);
    for (std::size_t first = 0; first < of_b.size(); first += kBlock) {
      const std::size_t count = std::min(kBlock, of_b.size() - first);
      for (std::size_t k = 0; k < ((count + 3) & ~std::size_t{3}); ++k) {
        const HullEdge& f = B.edges[of_b[first + std::min(k, count - 1)]];
        block.set(k, f, pair.b_in_A.at(f.ends[0]));
      }
      for (std::size_t k = 0; k < count; k += 4) {
        block.turn(0, k, pair.X_AB.R), block.turn(2, k, pair.X_AB.R), block.turn(3, k, pair.X_AB.R);
        FourVectors f, q, l, m, c;
        block.load(f, 0, k), block.load(q, 1, k), block.load(l, 2, k), block.load(m, 3, k);
        for (const std::uint32_t i : of_a) {
          const HullEdge& e = A.edges[i];
          const dvec3 p = A.vertices.at(e.ends[0]);
          c.x = e.along.y * f.z - f.y * e.along.z;
          c.y = e.along.z * f.x - f.z * e.along.x;
          c.z = e.along.x * f.y - f.x * e.along.y;
          const Four s = (p.x - q.x) * c.x + (p.y - q.y) * c.y + (p.z - q.z) * c.z;
          const Four a_0 = e.limits[0].x * c.x + e.limits[0].y * c.y + e.limits[0].z * c.z,
                     a_1 = e.limits[1].x * c.x + e.limits[1].y * c.y + e.limits[1].z * c.z;
          const Four b_0 = l.x * c.x + l.y * c.y + l.z * c.z, b_1 = m.x * c.x + m.y * c.y + m.z * c.z;
          const FourIndices is_below = s * s < below * below * (c.x * c.x + c.y * c.y + c.z * c.z);
          const FourIndices along_c = (a_0 >= -kGrazing) & (a_1 >= -kGrazing) & (b_0 <= kGrazing) & (b_1 <= kGrazing),
                            against_c = (a_0 <= kGrazing) & (a_1 <= kGrazing) & (b_0 >= -kGrazing) & (b_1 >= -kGrazing);
          const FourIndices found = is_below & (along_c | against_c);
          if ((found[0] | found[1] | found[2] | found[3]) == 0) continue;
          for (std::size_t lane = 0; lane < 4 && k + lane < count; ++lane) {
            if (found[lane] != 0) try_edges(i, line_of_b(of_b[first + k + lane]));
          }
        }
      }
    }
  }
};

// The overlap along the direction is right whatever the axis; across it the witnesses are taken from the features that
// met: a vertex over a face, or the two edges' common perpendicular. These may lie beside a face or beyond an edge's
// end: see keep_on_hulls().
void place_witnesses(const Search& search, LeastTranslation& result) {
  const HullShape& A = search.A;
  const dvec3 d = result.direction;
  switch (search.axis.kind) {
    case Kind::kFaceOfA: {
      const Reach b = farthest(search.pair.b_in_A, -d);
      result.p_b = search.pair.b_in_A.at(b.vertex);
      result.p_a = result.p_b + result.depth_m * d;
      result.feature_a = {Feature::kFace, search.axis.a}, result.feature_b = {Feature::kVertex, b.vertex};
      return;
    }
    case Kind::kEdges: {
      const HullEdge& e = A.edges[search.axis.a];
      const Search::LineOfB f = search.line_of_b(search.axis.b);
      const dvec3 c = cross(e.along, f.along), p = A.vertices.at(e.ends[0]);
      const double t = dot(cross(f.point - p, f.along), c) / dot(c, c);
      result.p_a = p + t * e.along;
      result.p_b = result.p_a - result.depth_m * d;
      result.feature_a = {Feature::kEdge, search.axis.a}, result.feature_b = {Feature::kEdge, search.axis.b};
      return;
    }
    default:
      const Reach a = farthest(A.vertices, d);
      result.p_a = A.vertices.at(a.vertex);
      result.p_b = result.p_a - result.depth_m * d;
      result.feature_a = {Feature::kVertex, a.vertex}, result.feature_b = {Feature::kFace, search.axis.b};
  }
}

}  // namespace

TranslationScratch::TranslationScratch(std::size_t most_faces, std::size_t most_edges)
    : overlap_m(most_faces + 4),
      out_a(most_faces + 4),
      out_b(most_faces + 4),
      faces_left(most_faces / 4 + 1),
      edges_a(most_edges),
      edges_b(most_edges) {}

FARFEEL_WIDE_VECTORS
LeastTranslation least_translation(const PlacedPair& pair, TranslationAxis& guess, TranslationScratch& scratch,
                                   double enough_m) noexcept {
  counting::count(Work::kTranslations);
  Search search(pair, !face_one_way(pair), enough_m, scratch);
  search.run(guess);
  if (search.depth == kInfinity) {  // by rounding only
    search.only_admissible = false;
    search.run({});
  }
  guess = search.axis;
  LeastTranslation result{search.depth, search.direction, dvec3(0), dvec3(0), true, {}, {}};
  if (!search.only_admissible) result.is_admissible = search.is_admissible(search.direction);
  place_witnesses(search, result);
  keep_on_hulls(pair, result);
  return result;
}

FARFEEL_WIDE_VECTORS
bool is_parted_by(const PlacedPair& pair, const TranslationAxis& guess, TranslationScratch& scratch) noexcept {
  Search search(pair, true, 0, scratch);
  search.try_guess(guess);
  return search.depth <= 0;
}

}  // namespace farfeel::collision
