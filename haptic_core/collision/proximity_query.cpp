// Time coherence, four times over:
//   - a list of candidates that stays complete while T moves by less than a slack, see candidate_list.h;
//   - a candidate found to be farther than the tolerance sleeps until T has moved by the difference;
//   - a candidate keeps the simplex of its last answer, where the next one starts, and usually ends;
//   - an overlapping one keeps where its least translation was found.
// Motion is summed over queries as the largest displacement of any point of T's bounding box. A point's displacement is
// an affine function of the point, so it is largest at one of the eight corners.
#include "haptic_core/collision/proximity_query.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/collision/candidate_list.h"
#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/last_simplex.h"
#include "haptic_core/collision/moved_vertices.h"
#include "haptic_core/counting/work.h"

namespace farfeel::collision {
namespace {

using glm::dmat3;
using glm::dot;
using glm::dvec3;

constexpr std::uint32_t kMostPairs = 16'384;
constexpr std::uint32_t kCandidatesPerPair = 4;  // room for pairs within the slack
constexpr double kRounding = 1e-12;              // of the coordinates' size: nearer counts as touching
constexpr double kMargin = 1 + 1e-9;             // on bounds of motion and distance, for rounding
constexpr std::uint32_t kBigHull = 64;           // vertices: bigger pieces of T are not moved into S's frame

double largest(const dvec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

std::uint32_t most_pairs(const HullTree& S, const HullTree& T, std::uint32_t asked) {
  const std::uint64_t all = std::uint64_t(S.pieces().size()) * T.pieces().size();
  return std::uint32_t(std::min<std::uint64_t>(all, asked > 0 ? asked : kMostPairs));
}

std::uint32_t most_candidates(const HullTree& S, const HullTree& T, std::uint32_t asked) {
  const std::uint64_t all = std::uint64_t(S.pieces().size()) * T.pieces().size();
  return std::uint32_t(std::min<std::uint64_t>(all, std::uint64_t(most_pairs(S, T, asked)) * kCandidatesPerPair));
}

double rounding_of(const HullTree& S, const HullTree& T) {
  const auto extent = [](const geometry::Box& b) { return largest(glm::max(glm::abs(b.low), glm::abs(b.high))); };
  const bool is_empty = S.pieces().size() == 0 || T.pieces().size() == 0;
  return is_empty ? 0 : kRounding * (extent(S.pieces().box) + extent(T.pieces().box));
}

TranslationScratch scratch_for(const HullTree& S, const HullTree& T) {
  std::size_t faces = 0, edges = 0;
  for (const HullTree* tree : {&S, &T}) {
    for (const ConvexPiece& piece : tree->pieces().pieces) {
      faces = std::max<std::size_t>(faces, piece.face_count), edges = std::max<std::size_t>(edges, piece.edge_count);
    }
  }
  return {faces, edges};
}

}  // namespace

// Everything is computed in S's frame less S's centre, from T's coordinates less T's centre: offset is the vector
// between the centres. Coordinates then are of the objects' size wherever the objects are.
struct ProximityQuery::State {
  const HullTree *S, *T;
  std::uint32_t max_pairs;
  double rounding_m;
  std::vector<ProximityPair> pairs;
  CandidateList list;
  std::vector<std::uint32_t> awake;
  TranslationScratch scratch;
  std::uint64_t left_out = 0;
  MovedVertices t_in_s, s_in_t;

  Placement X_ST, X_TS;  // between the centres
  double tolerance_m = 0;
  double motion_m = 0;  // summed since construction

  State(const HullTree& s, const HullTree& t, std::uint32_t most)
      : S(&s),
        T(&t),
        max_pairs(most_pairs(s, t, most)),
        rounding_m(rounding_of(s, t)),
        list(s, t, most_candidates(s, t, most), rounding_m),
        scratch(scratch_for(s, t)),
        t_in_s(t.pieces()),
        s_in_t(s.pieces()) {
    pairs.reserve(max_pairs);
    awake.resize(most_candidates(s, t, most));
  }

  double displacement(const Placement& X_new) const {
    const dmat3 turn = X_new.R - X_ST.R;
    const dvec3 shift = X_new.p - X_ST.p;
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const dvec3 &low = T->pieces().box.low, &high = T->pieces().box.high;
      const dvec3 p(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z);
      const dvec3 step = turn * p + shift;
      most = std::max(most, dot(step, step));
    }
    return std::sqrt(most) * kMargin + rounding_m;
  }

  FARFEEL_WIDE_VECTORS
  void measure(Candidate& c, double& asleep_until_m) {
    const ConvexPieces &p = S->pieces(), &q = T->pieces();
    // A big piece stays where it is and the other moves into its frame.
    const bool in_t = q.pieces[c.piece_t].vertex_count > kBigHull &&
                      q.pieces[c.piece_t].vertex_count >= p.pieces[c.piece_s].vertex_count;
    const HullVertices vertices_s = in_t ? s_in_t.of(c.piece_s) : p.vertices(c.piece_s);
    const HullVertices vertices_t = in_t ? q.vertices(c.piece_t) : t_in_s.of(c.piece_t);
    Separation apart;
    counting::count(Work::kGjkSteps);
    if (!separation_on_last_simplex(vertices_s, vertices_t, tolerance_m, rounding_m, c.simplex, apart)) {
      counting::count(Work::kGjkWalks);
      apart = separation(vertices_s, vertices_t, tolerance_m, rounding_m, c.simplex);
      if (apart.apartness != Apartness::kTouching) {
        c.feature_s = feature_of(p.shape(c.piece_s), c.simplex.count, c.simplex.a);
        c.feature_t = feature_of(q.shape(c.piece_t), c.simplex.count, c.simplex.b);
      }
    }
    if (apart.apartness == Apartness::kBeyond ||
        (apart.apartness == Apartness::kApart && !(apart.distance_m < tolerance_m))) {
      asleep_until_m = motion_m + (apart.distance_m - tolerance_m) / kMargin - rounding_m;
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
      pair.feature_s = c.feature_s, pair.feature_t = c.feature_t;
    } else {
      const LeastTranslation overlap =
          in_t ? least_translation({q.shape(c.piece_t), p.shape(c.piece_s), t_in_s.of(c.piece_t), vertices_s, X_TS},
                                   c.axis, scratch)
               : least_translation({p.shape(c.piece_s), q.shape(c.piece_t), s_in_t.of(c.piece_s), vertices_t, X_ST},
                                   c.axis, scratch);
      pair.distance_m = -overlap.depth_m;
      pair.p_Ss_S = in_t ? overlap.p_b : overlap.p_a, pair.p_St_S = in_t ? overlap.p_a : overlap.p_b;
      pair.nhat_ST_S = in_t ? -overlap.direction : overlap.direction;
      pair.is_admissible = overlap.is_admissible;
      pair.feature_s = in_t ? overlap.feature_b : overlap.feature_a;
      pair.feature_t = in_t ? overlap.feature_a : overlap.feature_b;
    }
    if (in_t) {
      pair.p_Ss_S = X_ST.R * pair.p_Ss_S + X_ST.p, pair.p_St_S = X_ST.R * pair.p_St_S + X_ST.p;
      pair.nhat_ST_S = X_ST.R * pair.nhat_ST_S;
    }
    const double out_of_s = outwardness(p.outwards(c.piece_s), pair.nhat_ST_S);
    const double into_t = outwardness(q.outwards(c.piece_t), -(pair.nhat_ST_S * X_ST.R));
    pair.facing = std::max(0.0, out_of_s) * std::max(0.0, into_t);
    if (apart.apartness == Apartness::kApart) pair.is_admissible = out_of_s >= 0 && into_t >= 0;
    pair.p_Ss_S += p.centre_O, pair.p_St_S += p.centre_O;
  }

  std::span<const ProximityPair> nearer_than(double tolerance, const spatial::Pose& pose) {
    pairs.clear();
    if (S->pieces().size() == 0 || T->pieces().size() == 0) return pairs;
    Placement X_new{glm::mat3_cast(pose.R), {}};
    X_new.p = X_new.R * T->pieces().centre_O + (pose.p - S->pieces().centre_O);
    motion_m += displacement(X_new);
    tolerance_m = tolerance;
    X_ST = X_new;
    X_TS.R = glm::transpose(X_ST.R), X_TS.p = -(X_TS.R * X_ST.p);
    t_in_s.set_pose(X_ST), s_in_t.set_pose(X_TS);
    list.update(X_ST, motion_m, tolerance_m);
    const std::span<Candidate> candidates = list.candidates();
    const std::span<double> asleep_until_m = list.asleep_until_m();
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < candidates.size(); ++i) {
      awake[count] = i;
      count += asleep_until_m[i] < motion_m;
    }
    for (std::uint32_t k = 0; k < count; ++k) measure(candidates[awake[k]], asleep_until_m[awake[k]]);
    counting::count(Work::kQueries);
    counting::count(Work::kPairs, count);
    counting::count(Work::kNearPairs, pairs.size());
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
  state_->list.forget();
}
std::uint64_t ProximityQuery::pairs_left_out() const noexcept {
  return state_->left_out + state_->list.overflows();
}

}  // namespace farfeel::collision
