#include "haptic_core/contact/depth/points/point_fallback.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/depth/points/constants.h"
#include "haptic_core/contact/smooth_step.h"

namespace farfeel::contact {
namespace {

using collision::ProximityPair;
using spatial::Vector6;

Vector6 turned(const spatial::Pose& X_WS, const Vector6& in_S) {
  const spatial::Wrench g = spatial::wrench_from(in_S);
  return spatial::to_vector6(spatial::Wrench{spatial::rotate(X_WS, g.torque_Nm), spatial::rotate(X_WS, g.force_N)});
}

}  // namespace

PointFallback::PointFallback(const LayeredSurface& s, LayeredSurface& t, double tolerance_m, bool has_points)
    : s_(s),
      t_(t),
      tolerance_m_(tolerance_m),
      nearest_s_(s.facets.felt().haptic().piece_count),
      nearest_t_(t.facets.felt().haptic().piece_count),
      is_in_s_(nearest_s_.size(), 0),
      is_in_t_(nearest_t_.size(), 0) {
  const bool is_textured = s.facets.felt().haptic().is_textured() || t.facets.felt().haptic().is_textured();
  if (!ablated(Mechanism::kPointFallback) && (has_layers() || (is_textured && has_points)))
    points_.emplace(s.facets, t.points, tolerance_m);
  noted_s_.reserve(nearest_s_.size());
  noted_t_.reserve(nearest_t_.size());
}

/// Of all stacked pairs among these pieces, the one whose farther piece is nearest to the other object: that piece's
/// pair.
PointFallback::Nearest PointFallback::nearest_stack(const StackedPieces& stacked, std::span<const std::uint32_t> pieces,
                                                    const std::vector<Nearest>& nearest) noexcept {
  Nearest best;
  for (const std::uint32_t piece : pieces) {
    for (const std::uint32_t other : stacked.with(piece)) {
      if (other < piece) continue;
      const Nearest& farther = nearest[piece].weight_m < nearest[other].weight_m ? nearest[piece] : nearest[other];
      if (farther.weight_m > best.weight_m) best = farther;
    }
  }
  return best;
}

PointShare PointFallback::share_by_layers(const Cluster& cluster, std::span<const ProximityPair> pairs,
                                          const glm::dvec3& p_STo_S) noexcept {
  if (!has_layers() || ablated(Mechanism::kPointFallback)) return {};
  const auto pieces_s = cluster.pieces_s.view(), pieces_t = cluster.pieces_t.view();
  for (const std::uint32_t piece : pieces_s) is_in_s_[piece] = 1;
  for (const std::uint32_t piece : pieces_t) is_in_t_[piece] = 1;
  noted_s_.clear();
  noted_t_.clear();
  const auto note = [](Nearest& nearest, double weight_m, const ProximityPair& pair, std::uint32_t piece,
                       std::vector<std::uint32_t>& noted) {
    if (!(weight_m > nearest.weight_m)) return;
    if (!nearest.pair) noted.push_back(piece);
    nearest = {weight_m, &pair};
  };
  // What is near the cluster's pieces counts too: a pair may be another cluster's and yet be what is felt here.
  for (const ProximityPair& pair : pairs) {
    if (is_in_s_[pair.piece_s] == 0 && is_in_t_[pair.piece_t] == 0) continue;
    const double weight_m = (std::min(tolerance_m_, kLayersFrom_m) - pair.distance_m) * squareness(pair.facing);
    note(nearest_s_[pair.piece_s], weight_m, pair, pair.piece_s, noted_s_);
    note(nearest_t_[pair.piece_t], weight_m, pair, pair.piece_t, noted_t_);
  }
  const Nearest of_s = nearest_stack(s_.stacked, noted_s_, nearest_s_),
                of_t = nearest_stack(t_.stacked, noted_t_, nearest_t_);
  for (const std::uint32_t piece : pieces_s) is_in_s_[piece] = 0;
  for (const std::uint32_t piece : pieces_t) is_in_t_[piece] = 0;
  for (const std::uint32_t piece : noted_s_) nearest_s_[piece] = {};
  for (const std::uint32_t piece : noted_t_) nearest_t_[piece] = {};
  const Nearest& nearest = of_s.weight_m > of_t.weight_m ? of_s : of_t;
  if (!nearest.pair) return {};
  const double x = std::min(nearest.weight_m / kLayersWithin_m, 1.0);
  const glm::dvec3& n = nearest.pair->nhat_ST_S;
  const Vector6 nearing = spatial::to_vector6(spatial::Wrench{-glm::cross(nearest.pair->p_St_S - p_STo_S, n), -n});
  return {smooth_step(x), smooth_step_slope(x) * squareness(nearest.pair->facing) / kLayersWithin_m * nearing};
}

PointShare share_by_floor(const Contact& contact, bool is_known, const DepthSource& coarse, double margin_m,
                          const spatial::Pose& X_WS) noexcept {
  if (!(coarse.depth_m > 0)) return {};
  const double y = std::min(coarse.depth_m / kOverlapWithin_m, 1.0), overlap = smooth_step(y);
  const Vector6 overlapping = smooth_step_slope(y) / kOverlapWithin_m * coarse.gradient;
  if (!is_known) return {overlap, overlapping};
  const double x = std::clamp((coarse.depth_m - margin_m - contact.depth_m) / kFloorWithin_m, 0.0, 1.0);
  if (!(x > 0)) return {};
  const Vector6 apart = coarse.gradient - turned(spatial::inverse(X_WS), contact.gradient);
  return {overlap * smooth_step(x),
          overlap * smooth_step_slope(x) / kFloorWithin_m * apart + smooth_step(x) * overlapping};
}

PointShare share_by_ceiling(const Contact& contact, const DepthSource& coarse, double margin_m,
                            const spatial::Pose& X_WS) noexcept {
  if (!std::isfinite(coarse.depth_m) || ablated(Mechanism::kLayerCeiling)) return {};
  const double x = std::clamp((contact.depth_m - coarse.depth_m - margin_m) / kFloorWithin_m, 0.0, 1.0);
  if (!(x > 0)) return {};
  const Vector6 apart = turned(spatial::inverse(X_WS), contact.gradient) - coarse.gradient;
  return {smooth_step(x), smooth_step_slope(x) / kFloorWithin_m * apart};
}

PointShare either(const PointShare& a, const PointShare& b) noexcept {
  return {1 - (1 - a.share) * (1 - b.share), (1 - b.share) * a.gradient + (1 - a.share) * b.gradient};
}

void mix_in(Contact& contact, const PointShare& share, const DepthSource& points, double apart_m,
            const spatial::Pose& X_WS) noexcept {
  const bool is_any = std::isfinite(points.depth_m);
  const double depth_m = is_any ? points.depth_m : std::min(contact.depth_m, -apart_m);
  Vector6 moved = (depth_m - contact.depth_m) * turned(X_WS, share.gradient);
  const double steepness = moved.tail<3>().norm();
  if (steepness > kSteepestShare) moved *= kSteepestShare / steepness;
  if (is_any) {
    contact.gradient += share.share * (turned(X_WS, points.gradient) - contact.gradient);
    contact.p_WC_W = glm::mix(contact.p_WC_W, spatial::transform_point(X_WS, points.p_S), share.share);
  }
  contact.gradient += moved;
  contact.depth_m += share.share * (depth_m - contact.depth_m);
}

}  // namespace farfeel::contact
