#include "haptic_core/collision/proximity_query.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/collision/convex_pair.h"

namespace farfeel::collision {
namespace {

using glm::dmat3;
using glm::dot;
using glm::dvec3;

constexpr std::uint32_t kMostPairs = 16'384;
constexpr double kRounding = 1e-12;  // of the coordinates' size: nearer counts as touching

double largest(const dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

dmat3 absolute(const dmat3& m) {
  return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])};
}

}  // namespace

// Everything is computed in S's frame less S's centre, from T's coordinates less T's centre: offset = the vector
// between the centres. Coordinates then are of the objects' size wherever the objects are.
struct ProximityQuery::State {
  const HullTree *S, *T;
  std::uint32_t max_pairs;
  std::vector<ProximityPair> pairs;
  std::uint64_t left_out = 0;

  // The pose of this query.
  dmat3 R, R_abs;
  dvec3 offset;
  double tolerance_m = 0, rounding_m = 0;

  // T's pieces in S's frame, filled for a piece when it is first needed.
  std::uint64_t now = 0;
  std::vector<std::uint64_t> vertices_at, gauss_map_at;
  std::vector<double> x, y, z;
  std::vector<HullFace> faces;
  std::vector<HullArc> arcs;
  std::vector<dvec3> outwards;

  struct Memory {
    std::uint32_t piece_s = ~0U, piece_t = ~0U;
    PairSimplex simplex;
  };
  std::vector<Memory> memories;  // direct-mapped by pair; a stranger's entry is only a bad guess

  State(const HullTree& s, const HullTree& t, std::uint32_t most) : S(&s), T(&t) {
    const std::uint64_t all = std::uint64_t(s.pieces().size()) * t.pieces().size();
    max_pairs = std::uint32_t(std::min<std::uint64_t>(all, most > 0 ? most : kMostPairs));
    pairs.reserve(max_pairs);
    const ConvexPieces& pieces = t.pieces();
    vertices_at.assign(pieces.size(), 0), gauss_map_at.assign(pieces.size(), 0);
    x.resize(pieces.x.size()), y.resize(pieces.x.size()), z.resize(pieces.x.size());
    faces = pieces.faces, arcs = pieces.arcs, outwards = pieces.outwards;
    std::size_t slots = 1024;
    while (slots < 4 * std::size_t(max_pairs)) slots *= 2;
    memories.resize(slots);
  }

  HullVertices vertices_s(std::uint32_t s) const {
    const ConvexPieces& p = S->pieces();
    const std::uint32_t i = p.pieces[s].first_vertex;
    return {&p.x[i], &p.y[i], &p.z[i], p.pieces[s].vertex_count};
  }

  HullVertices vertices_t(std::uint32_t t) {
    const ConvexPieces& p = T->pieces();
    const ConvexPiece& piece = p.pieces[t];
    if (vertices_at[t] != now) {
      vertices_at[t] = now;
      for (std::uint32_t i = piece.first_vertex; i < piece.first_vertex + piece.vertex_count; ++i) {
        const dvec3 v = R * p.vertex(i) + offset;
        x[i] = v.x, y[i] = v.y, z[i] = v.z;
      }
    }
    const std::uint32_t i = piece.first_vertex;
    return {&x[i], &y[i], &z[i], piece.vertex_count};
  }

  HullShape shape_s(std::uint32_t s) const {
    const ConvexPieces& p = S->pieces();
    const ConvexPiece& piece = p.pieces[s];
    return {vertices_s(s),
            {&p.faces[piece.first_face], piece.face_count},
            {p.arcs.data() + piece.first_arc, piece.arc_count},
            {p.outwards.data() + piece.first_outward, piece.faces_every_way ? 0 : piece.outward_count}};
  }

  HullShape shape_t(std::uint32_t t) {
    const ConvexPieces& p = T->pieces();
    const ConvexPiece& piece = p.pieces[t];
    if (gauss_map_at[t] != now) {
      gauss_map_at[t] = now;
      for (std::uint32_t k = piece.first_face; k < piece.first_face + piece.face_count; ++k) {
        faces[k].normal = R * p.faces[k].normal;
      }
      for (std::uint32_t k = piece.first_arc; k < piece.first_arc + piece.arc_count; ++k) {
        arcs[k] = {p.arcs[k].ends, R * p.arcs[k].along, R * p.arcs[k].from, R * p.arcs[k].to};
      }
      for (std::uint32_t k = piece.first_outward; k < piece.first_outward + piece.outward_count; ++k) {
        outwards[k] = R * p.outwards[k];
      }
    }
    return {vertices_t(t),
            {&faces[piece.first_face], piece.face_count},
            {arcs.data() + piece.first_arc, piece.arc_count},
            {outwards.data() + piece.first_outward, piece.faces_every_way ? 0 : piece.outward_count}};
  }

  PairSimplex& memory(std::uint32_t s, std::uint32_t t) {
    const std::uint64_t hash = (std::uint64_t(s) << 32 | t) * 0x9E37'79B9'7F4A'7C15U;
    Memory& m = memories[(hash >> 32) & (memories.size() - 1)];
    if (m.piece_s != s || m.piece_t != t) m = {s, t, {}};
    return m.simplex;
  }

  // A lower bound of the distance of two boxes: the widest gap along the six face normals.
  double gap(const HullTreeNode& a, const HullTreeNode& b) const {
    const dvec3 c = R * b.centre + offset - a.centre;
    const dvec3 along_s = glm::abs(c) - a.half - R_abs * b.half;
    const dvec3 along_t = glm::abs(c * R) - b.half - a.half * R_abs;
    const dvec3 most = glm::max(along_s, along_t);
    return std::max({most.x, most.y, most.z});
  }

  void descend(std::uint32_t i, std::uint32_t j) {
    const HullTreeNode &a = S->nodes()[i], &b = T->nodes()[j];
    if (gap(a, b) >= tolerance_m) return;
    if (a.count == 1 && b.count == 1) return measure(S->order()[a.first], T->order()[b.first]);
    const bool split_s = b.count == 1 || (a.count > 1 && dot(a.half, a.half) > dot(b.half, b.half));
    if (split_s) {
      descend(i + 1, j), descend(a.second_child, j);
    } else {
      descend(i, j + 1), descend(i, b.second_child);
    }
  }

  void measure(std::uint32_t s, std::uint32_t t) {
    const Separation apart = separation(vertices_s(s), vertices_t(t), dvec3(0), tolerance_m, rounding_m, memory(s, t));
    if (apart.apartness == Apartness::kBeyond) return;
    ProximityPair pair{s, t, apart.distance_m, apart.p_a, apart.p_b, dvec3(0), 0, true};
    if (apart.apartness == Apartness::kApart) {
      if (!(apart.distance_m < tolerance_m)) return;
      pair.nhat_ST_S = (apart.p_b - apart.p_a) / apart.distance_m;
    } else {
      const LeastTranslation overlap = least_translation(shape_s(s), shape_t(t), rounding_m);
      pair.distance_m = -overlap.depth_m;
      pair.p_Ss_S = overlap.p_a, pair.p_St_S = overlap.p_b, pair.nhat_ST_S = overlap.direction;
      pair.is_admissible = overlap.is_admissible;
    }
    const ConvexPieces &p = S->pieces(), &q = T->pieces();
    const double out_of_s = p.outwardness(p.pieces[s], pair.nhat_ST_S);
    const double into_t = q.outwardness(q.pieces[t], -(pair.nhat_ST_S * R));
    pair.facing = std::max(0.0, out_of_s) * std::max(0.0, into_t);
    if (apart.apartness == Apartness::kApart) pair.is_admissible = out_of_s >= 0 && into_t >= 0;
    pair.p_Ss_S += p.centre_O, pair.p_St_S += p.centre_O;
    if (pairs.size() == max_pairs) {
      ++left_out;
      return;
    }
    pairs.push_back(pair);
  }

  std::span<const ProximityPair> nearer_than(double tolerance, const spatial::Pose& X_ST) {
    ++now;
    pairs.clear();
    tolerance_m = tolerance;
    R = glm::mat3_cast(X_ST.R);
    R_abs = absolute(R);
    offset = R * T->pieces().centre_O + (X_ST.p - S->pieces().centre_O);
    const auto extent = [](const ConvexPieces& p) { return largest(glm::max(glm::abs(p.low), glm::abs(p.high))); };
    rounding_m = kRounding * (extent(S->pieces()) + extent(T->pieces()));
    if (S->pieces().size() > 0 && T->pieces().size() > 0) descend(0, 0);
    std::sort(pairs.begin(), pairs.end(), [](const ProximityPair& a, const ProximityPair& b) {
      return std::pair(a.piece_s, a.piece_t) < std::pair(b.piece_s, b.piece_t);
    });
    return pairs;
  }
};

ProximityQuery::ProximityQuery(const HullTree& S, const HullTree& T, std::uint32_t max_pairs)
    : state_(std::make_unique<State>(S, T, max_pairs)) {}
ProximityQuery::~ProximityQuery() = default;
ProximityQuery::ProximityQuery(ProximityQuery&&) noexcept = default;
ProximityQuery& ProximityQuery::operator=(ProximityQuery&&) noexcept = default;

std::span<const ProximityPair> ProximityQuery::nearer_than(double tolerance_m, const spatial::Pose& X_ST) noexcept {
  return state_->nearer_than(tolerance_m, X_ST);
}
std::uint64_t ProximityQuery::pairs_left_out() const noexcept {
  return state_->left_out;
}

}  // namespace farfeel::collision
