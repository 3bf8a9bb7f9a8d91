// Time coherence, three times over:
//   - a list of candidates: pairs whose boxes are nearer than tolerance + slack. It stays complete until T has moved by
//     the slack; only then are the trees descended again;
//   - a candidate found to be farther than the tolerance sleeps until T has moved by the difference;
//   - each candidate keeps the simplex and the axis of its last answer, where the next one starts.
// Motion is summed over queries as the largest displacement of any point of T's bounding box. A point's displacement is
// an affine function of the point, so it is largest at one of the eight corners.
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
constexpr std::uint32_t kCandidatesPerPair = 4;  // room for pairs within the slack
constexpr double kRounding = 1e-12;              // of the coordinates' size: nearer counts as touching
constexpr double kSlack = 0.4;                   // of the tolerance
constexpr double kMargin = 1 + 1e-9;             // on bounds of motion and distance, for rounding
constexpr std::uint32_t kBigHull = 64;           // vertices: bigger pieces of T are not moved into S's frame

double largest(const dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

dmat3 absolute(const dmat3& m) {
  return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])};
}

struct Candidate {
  std::uint32_t piece_s, piece_t;
  double asleep_until_m = -1;  // of the motion's sum
  PairSimplex simplex{};
  TranslationAxis axis{};

  std::uint64_t key() const { return std::uint64_t(piece_s) << 32 | piece_t; }
};

HullVertices vertices_of(const ConvexPieces& p, const ConvexPiece& piece) {
  const std::uint32_t i = piece.first_vertex;
  return {&p.x[i], &p.y[i], &p.z[i], piece.vertex_count};
}

HullShape shape_of(const ConvexPieces& p, const ConvexPiece& piece) {
  return {vertices_of(p, piece),
          {p.faces.data() + piece.first_face, piece.face_count},
          {p.edges.data() + piece.first_edge, piece.edge_count},
          {p.outwards.data() + piece.first_outward, piece.outward_count},
          piece.outward_face_count,
          piece.outward_edge_count};
}

// Pieces written in another object's frame, each when it is first needed after the pose has changed.
class MovedPieces {
 public:
  explicit MovedPieces(const ConvexPieces& from)
      : from_(&from), moved_(from), vertices_at_(from.size()), shape_at_(from.size()) {}

  void set_pose(const dmat3& R, const dvec3& offset) { R_ = R, offset_ = offset, ++now_; }

  HullVertices vertices(std::uint32_t i) {
    const ConvexPiece& piece = from_->pieces[i];
    if (vertices_at_[i] != now_) {
      vertices_at_[i] = now_;
      for (std::uint32_t k = piece.first_vertex; k < piece.first_vertex + piece.vertex_count; ++k) {
        const double x = from_->x[k], y = from_->y[k], z = from_->z[k];
        moved_.x[k] = R_[0].x * x + R_[1].x * y + R_[2].x * z + offset_.x;
        moved_.y[k] = R_[0].y * x + R_[1].y * y + R_[2].y * z + offset_.y;
        moved_.z[k] = R_[0].z * x + R_[1].z * y + R_[2].z * z + offset_.z;
      }
    }
    return vertices_of(moved_, piece);
  }

  HullShape shape(std::uint32_t i) {
    const ConvexPiece& piece = from_->pieces[i];
    vertices(i);
    if (shape_at_[i] != now_) {
      shape_at_[i] = now_;
      for (std::uint32_t k = piece.first_face; k < piece.first_face + piece.face_count; ++k) {
        const dvec3 n = R_ * from_->faces[k].normal;
        moved_.faces[k] = {n, from_->faces[k].offset_m + dot(n, offset_)};
      }
      for (std::uint32_t k = piece.first_edge; k < piece.first_edge + piece.edge_count; ++k) {
        const HullEdge& e = from_->edges[k];
        moved_.edges[k].along = R_ * e.along;
        moved_.edges[k].limits = {R_ * e.limits[0], R_ * e.limits[1]};
      }
      for (std::uint32_t k = piece.first_outward; k < piece.first_outward + piece.outward_count; ++k) {
        moved_.outwards[k] = R_ * from_->outwards[k];
      }
    }
    return shape_of(moved_, piece);
  }

 private:
  const ConvexPieces* from_;
  ConvexPieces moved_;
  dmat3 R_{1};
  dvec3 offset_{0};
  std::uint64_t now_ = 0;
  std::vector<std::uint64_t> vertices_at_, shape_at_;
};

}  // namespace

// Everything is computed in S's frame less S's centre, from T's coordinates less T's centre: offset is the vector
// between the centres. Coordinates then are of the objects' size wherever the objects are.
struct ProximityQuery::State {
  const HullTree *S, *T;
  std::uint32_t max_pairs, max_candidates;
  std::vector<ProximityPair> pairs;
  std::vector<Candidate> candidates, last_candidates;  // ordered by key
  std::uint64_t left_out = 0;
  MovedPieces t_in_s, s_in_t;

  // The pose of this query.
  dmat3 R{1}, R_abs{1};
  dvec3 offset{0};
  double tolerance_m = 0, rounding_m = 0;

  double motion_m = 0;        // summed since construction
  double list_good_to_m = 0;  // of motion_m
  double list_tolerance_m = -1;

  State(const HullTree& s, const HullTree& t, std::uint32_t most)
      : S(&s), T(&t), t_in_s(t.pieces()), s_in_t(s.pieces()) {
    const std::uint64_t all = std::uint64_t(s.pieces().size()) * t.pieces().size();
    max_pairs = std::uint32_t(std::min<std::uint64_t>(all, most > 0 ? most : kMostPairs));
    max_candidates = std::uint32_t(std::min<std::uint64_t>(all, std::uint64_t(max_pairs) * kCandidatesPerPair));
    pairs.reserve(max_pairs);
    candidates.reserve(max_candidates + 1), last_candidates.reserve(max_candidates + 1);
    const auto extent = [](const geometry::Box& b) { return largest(glm::max(glm::abs(b.low), glm::abs(b.high))); };
    if (all > 0) rounding_m = kRounding * (extent(s.pieces().box) + extent(t.pieces().box));
  }

  double displacement(const dmat3& R_new, const dvec3& offset_new) const {
    const dmat3 turn = R_new - R;
    const dvec3 shift = offset_new - offset;
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const dvec3 &low = T->pieces().box.low, &high = T->pieces().box.high;
      const dvec3 p(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z);
      const dvec3 step = turn * p + shift;
      most = std::max(most, dot(step, step));
    }
    return std::sqrt(most) * kMargin + rounding_m;
  }

  // A lower bound of the distance of two boxes: the widest gap along their six face normals.
  double gap(const HullTreeNode& a, const HullTreeNode& b) const {
    const dvec3 c = R * b.centre + offset - a.centre;
    const dvec3 along_s = glm::abs(c) - a.half - R_abs * b.half;
    const dvec3 along_t = glm::abs(c * R) - b.half - a.half * R_abs;
    const dvec3 most = glm::max(along_s, along_t);
    return std::max({most.x, most.y, most.z});
  }

  void descend(std::uint32_t i, std::uint32_t j, double reach_m) {
    const HullTreeNode &a = S->nodes()[i], &b = T->nodes()[j];
    const double apart_m = gap(a, b);
    if (apart_m >= reach_m || candidates.size() > max_candidates) return;
    if (a.count == 1 && b.count == 1) {
      Candidate& c = candidates.emplace_back();
      c.piece_s = S->order()[a.first], c.piece_t = T->order()[b.first];
      if (apart_m > tolerance_m) c.asleep_until_m = motion_m + (apart_m - tolerance_m) / kMargin - rounding_m;
      return;
    }
    const bool split_s = b.count == 1 || (a.count > 1 && dot(a.half, a.half) > dot(b.half, b.half));
    if (split_s) {
      descend(i + 1, j, reach_m), descend(a.second_child, j, reach_m);
    } else {
      descend(i, j + 1, reach_m), descend(i, b.second_child, reach_m);
    }
  }

  void list_candidates() {
    std::swap(candidates, last_candidates);
    double slack = kSlack * tolerance_m;
    candidates.clear();
    descend(0, 0, (tolerance_m + slack) * kMargin + rounding_m);
    if (candidates.size() > max_candidates) {  // too many: do without slack
      slack = 0;
      candidates.clear();
      descend(0, 0, tolerance_m * kMargin + rounding_m);
      if (candidates.size() > max_candidates) ++left_out, candidates.resize(max_candidates);
    }
    list_good_to_m = motion_m + slack;
    const bool same_tolerance = list_tolerance_m == tolerance_m;
    list_tolerance_m = tolerance_m;
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.key() < b.key(); });
    auto last = last_candidates.begin();
    for (Candidate& c : candidates) {
      while (last != last_candidates.end() && last->key() < c.key()) ++last;
      if (last == last_candidates.end()) break;
      if (last->key() != c.key()) continue;
      c.simplex = last->simplex, c.axis = last->axis;
      if (same_tolerance) c.asleep_until_m = std::max(c.asleep_until_m, last->asleep_until_m);
    }
  }

  void measure(Candidate& c) {
    const ConvexPieces &p = S->pieces(), &q = T->pieces();
    const ConvexPiece &piece_s = p.pieces[c.piece_s], &piece_t = q.pieces[c.piece_t];
    // A big piece stays where it is and the other moves into its frame.
    const bool in_t = piece_t.vertex_count > kBigHull && piece_t.vertex_count >= piece_s.vertex_count;
    const Separation apart = in_t ? separation(s_in_t.vertices(c.piece_s), vertices_of(q, piece_t), dvec3(0),
                                               tolerance_m, rounding_m, c.simplex)
                                  : separation(vertices_of(p, piece_s), t_in_s.vertices(c.piece_t), dvec3(0),
                                               tolerance_m, rounding_m, c.simplex);
    if (apart.apartness == Apartness::kBeyond ||
        (apart.apartness == Apartness::kApart && !(apart.distance_m < tolerance_m))) {
      c.asleep_until_m = motion_m + (apart.distance_m - tolerance_m) / kMargin - rounding_m;
      return;
    }
    if (pairs.size() == max_pairs) {
      ++left_out;
      return;
    }
    ProximityPair& pair = pairs.emplace_back();
    pair.piece_s = c.piece_s, pair.piece_t = c.piece_t;
    if (apart.apartness == Apartness::kApart) {
      pair.distance_m = apart.distance_m;
      pair.p_Ss_S = apart.p_a, pair.p_St_S = apart.p_b, pair.nhat_ST_S = apart.nhat;
    } else {
      const LeastTranslation overlap = in_t ? least_translation(s_in_t.shape(c.piece_s), shape_of(q, piece_t), c.axis)
                                            : least_translation(shape_of(p, piece_s), t_in_s.shape(c.piece_t), c.axis);
      pair.distance_m = -overlap.depth_m;
      pair.p_Ss_S = overlap.p_a, pair.p_St_S = overlap.p_b, pair.nhat_ST_S = overlap.direction;
      pair.is_admissible = overlap.is_admissible;
    }
    if (in_t) {
      pair.p_Ss_S = R * pair.p_Ss_S + offset, pair.p_St_S = R * pair.p_St_S + offset;
      pair.nhat_ST_S = R * pair.nhat_ST_S;
    }
    const double out_of_s = p.outwardness(piece_s, pair.nhat_ST_S);
    const double into_t = q.outwardness(piece_t, -(pair.nhat_ST_S * R));
    pair.facing = std::max(0.0, out_of_s) * std::max(0.0, into_t);
    if (apart.apartness == Apartness::kApart) pair.is_admissible = out_of_s >= 0 && into_t >= 0;
    pair.p_Ss_S += p.centre_O, pair.p_St_S += p.centre_O;
  }

  std::span<const ProximityPair> nearer_than(double tolerance, const spatial::Pose& X_ST) {
    pairs.clear();
    if (S->pieces().size() == 0 || T->pieces().size() == 0) return pairs;
    const dmat3 R_new = glm::mat3_cast(X_ST.R);
    const dvec3 offset_new = R_new * T->pieces().centre_O + (X_ST.p - S->pieces().centre_O);
    motion_m += displacement(R_new, offset_new);
    tolerance_m = tolerance;
    R = R_new, R_abs = absolute(R), offset = offset_new;
    t_in_s.set_pose(R, offset);
    const dmat3 R_TS = glm::transpose(R);
    s_in_t.set_pose(R_TS, -(R_TS * offset));
    if (motion_m > list_good_to_m || tolerance_m != list_tolerance_m) list_candidates();
    for (Candidate& c : candidates) {
      if (c.asleep_until_m < motion_m) measure(c);
    }
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
void ProximityQuery::restart() noexcept {
  state_->candidates.clear();
  state_->list_tolerance_m = -1;
}
std::uint64_t ProximityQuery::pairs_left_out() const noexcept {
  return state_->left_out;
}

}  // namespace farfeel::collision
