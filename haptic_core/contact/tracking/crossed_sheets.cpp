#include "haptic_core/contact/tracking/crossed_sheets.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/collision/hull_support.h"
#include "haptic_core/contact/smooth_step.h"
#include "haptic_core/contact/tracking/constants.h"
#include "haptic_core/contact/tracking/deepest.h"
#include "haptic_core/geometry/piece_thickness.h"

namespace farfeel::contact {
namespace {

using collision::ConvexPieces;
using collision::HullVertices;
using collision::ProximityPair;

collision::TranslationScratch scratch_for(const ConvexPieces& s, const ConvexPieces& t) {
  std::size_t faces = 0, edges = 0;
  for (const ConvexPieces* pieces : {&s, &t}) {
    for (const collision::ConvexPiece& piece : pieces->pieces) {
      faces = std::max<std::size_t>(faces, piece.face_count), edges = std::max<std::size_t>(edges, piece.edge_count);
    }
  }
  return {faces, edges};
}

std::vector<double> known_thickness_m(const geometry::HapticSurface& surface) {
  std::vector<double> all_m = geometry::piece_thickness_m(surface);
  std::replace(all_m.begin(), all_m.end(), 0.0, std::numeric_limits<double>::infinity());
  return all_m;
}

}  // namespace

CrossedSheets::CrossedSheets(const geometry::HapticSurface& S, const collision::HullTree& tree_s,
                             const geometry::HapticSurface& T, const collision::HullTree& tree_t)
    : s_(&tree_s.pieces()),
      t_(&tree_t.pieces()),
      t_in_s_(*t_),
      s_in_t_(*s_),
      scratch_(scratch_for(*s_, *t_)),
      thickness_s_m_(known_thickness_m(S)),
      thickness_t_m_(known_thickness_m(T)) {
  const std::size_t most = std::min<std::size_t>(std::size_t{s_->size()} * t_->size(), kMostPairs);
  mended_.reserve(most), tried_.reserve(most), last_tried_.reserve(most);
}

/// How far behind each other two sheets may be that were pressed through each other: as deep as a contact is looked up,
/// and the fade. What is behind that are the sheets of the material's other side.
double CrossedSheets::most_behind_m(const ProximityPair& pair) const noexcept {
  return deepest_m(std::min(thickness_s_m_[pair.piece_s], thickness_t_m_[pair.piece_t])) / kNearlyThrough;
}

// As a proximity query does: in S's frame less S's centre, from T's coordinates less T's centre.
void CrossedSheets::place(const spatial::Pose& X_ST) noexcept {
  collision::Placement X{glm::mat3_cast(X_ST.R), {}};
  X.p = X.R * t_->centre_O + (X_ST.p - s_->centre_O);
  const glm::dmat3 turn = X.R - t_in_s_.pose().R;
  turned_rad_ += std::sqrt(glm::dot(turn[0], turn[0]) + glm::dot(turn[1], turn[1]) + glm::dot(turn[2], turn[2]));
  t_in_s_.set_pose(X);
  const glm::dmat3 R_TS = glm::transpose(X.R);
  s_in_t_.set_pose({R_TS, -(R_TS * X.p)});
}

/// How squarely any direction can lead out of both at most: along the middle between two normals, by (1 + cos) / 2.
double CrossedSheets::most_facing(std::uint32_t piece_s, std::uint32_t piece_t) const noexcept {
  const HullVertices outwards_s = s_->outwards(piece_s), outwards_t = t_->outwards(piece_t);
  double most = -1;
  for (std::uint32_t k = 0; k < outwards_s.count; ++k) {
    most = std::max(most, collision::reach_along(outwards_t, -(outwards_s.at(k) * t_in_s_.pose().R)));
  }
  return 0.5 * (1 + most);
}

/// Whether they may face each other squarely enough, as most_facing() says. A normal's cosine changes by no more than T
/// turns, so what was worked out some time ago mostly says it, too.
bool CrossedSheets::may_face(Tried& tried, double near, std::uint32_t piece_s, std::uint32_t piece_t) const noexcept {
  const double off = 0.5 * (turned_rad_ - tried.turned_rad) + kRoundingOfCosines;
  if (near * (tried.most_facing + off) < kLeastFacing) return false;
  if (near * (tried.most_facing - off) >= kLeastFacing) return true;
  tried.most_facing = most_facing(piece_s, piece_t), tried.turned_rad = turned_rad_;
  return near * tried.most_facing >= kLeastFacing;
}

FARFEEL_WIDE_VECTORS
std::span<const ProximityPair> CrossedSheets::mended(std::span<const ProximityPair> pairs, double tolerance_m,
                                                     const spatial::Pose& X_ST) noexcept {
  if (ablated(Mechanism::kCrossedSheets)) return pairs;
  place(X_ST);
  std::swap(tried_, last_tried_);
  tried_.clear();
  auto last = last_tried_.begin();
  bool has_any = false;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ProximityPair& pair = pairs[i];
    if (pair.is_admissible || !(pair.distance_m > 0)) continue;
    const double most_m = std::min(tolerance_m, most_behind_m(pair));
    if (pair.distance_m > most_m) continue;
    const HullVertices outwards_s = s_->outwards(pair.piece_s), outwards_t = t_->outwards(pair.piece_t);
    if (outwards_s.count == 0 || outwards_t.count == 0) continue;  // one that faces every way has no behind
    const double near = share_between(pair.distance_m, most_m, kNearlyThrough * most_m);
    const std::uint64_t key = std::uint64_t{pair.piece_s} << 32 | pair.piece_t;
    while (last != last_tried_.end() && last->key < key) ++last;
    const bool is_known = last != last_tried_.end() && last->key == key;
    Tried& tried = tried_.emplace_back(is_known ? *last : Tried{key, 0, -kNeverTurned_rad, {}});
    if (!may_face(tried, near, pair.piece_s, pair.piece_t)) {
      tried.axis = {};
      continue;
    }
    const collision::PlacedPair placed{s_->shape(pair.piece_s), t_->shape(pair.piece_t), s_in_t_.of(pair.piece_s),
                                       t_in_s_.of(pair.piece_t), t_in_s_.pose()};
    if (collision::is_parted_by(placed, tried.axis, scratch_)) continue;
    const collision::LeastTranslation through = collision::least_translation(placed, tried.axis, scratch_, 0);
    if (!through.is_admissible || !(through.depth_m > 0)) continue;
    const glm::dvec3& u_S = through.direction;
    const double thickness_m = through.depth_m - glm::dot(pair.p_Ss_S - pair.p_St_S, u_S);
    const double facing = near * share_between(thickness_m, tolerance_m, kNearlyTooThick * tolerance_m) *
                          std::max(0.0, collision::outwardness(outwards_s, u_S)) *
                          std::max(0.0, collision::outwardness(outwards_t, -(u_S * t_in_s_.pose().R)));
    if (facing < kLeastFacing) continue;
    if (!has_any) mended_.assign(pairs.begin(), pairs.end());
    has_any = true;
    ProximityPair& crossed = mended_[i];
    crossed.nhat_ST_S = u_S;
    crossed.distance_m = -through.depth_m;
    crossed.p_Ss_S = through.p_a + s_->centre_O, crossed.p_St_S = through.p_b + s_->centre_O;
    crossed.feature_s = through.feature_a, crossed.feature_t = through.feature_b;
    crossed.facing = facing;
    crossed.is_admissible = true;
  }
  return has_any ? mended_ : pairs;
}

}  // namespace farfeel::contact
