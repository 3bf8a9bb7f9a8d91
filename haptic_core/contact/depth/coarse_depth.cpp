#include "haptic_core/contact/depth/coarse_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/constants.h"
#include "haptic_core/contact/smooth_step.h"

namespace farfeel::contact {
namespace {

using collision::ProximityPair;

bool holds(const PieceList& list, std::uint32_t piece) {
  const auto pieces = list.view();
  return std::find(pieces.begin(), pieces.end(), piece) != pieces.end();
}

/// How much a pair belongs to the cluster's contact.
double share_of(const ProximityPair& pair, const Cluster& cluster) {
  const double along = share_between(glm::dot(pair.nhat_ST_S, cluster.nhat_ST_S), kUnaligned, kAligned);
  if (!(along > 0)) return 0;
  const double square = squareness(pair.facing);
  return square > 0 && holds(cluster.pieces_s, pair.piece_s) && holds(cluster.pieces_t, pair.piece_t) ? along * square
                                                                                                      : 0;
}

}  // namespace

DepthSource coarse_depth(const Cluster& cluster, std::span<const ProximityPair> pairs, const glm::dvec3& p_STo_S,
                         double soft_width_m) noexcept {
  DepthSource sum = DepthSource{};
  double weights = 0, level_m = sum.depth_m;
  for (const ProximityPair& pair : pairs) {
    const double depth_m = -pair.distance_m, share = share_of(pair, cluster);
    if (!(share > 0)) continue;
    if (depth_m > level_m) {
      const double scale = weights > 0 ? std::exp((level_m - depth_m) / soft_width_m) : 0;
      weights *= scale, sum.gradient *= scale, sum.p_S *= scale;
      level_m = depth_m;
    }
    const double weight = share * std::exp((depth_m - level_m) / soft_width_m);
    const glm::dvec3& n = pair.nhat_ST_S;
    weights += weight;
    sum.p_S += weight * pair.p_St_S;
    sum.gradient += weight * spatial::to_vector6(spatial::Wrench{-glm::cross(pair.p_St_S - p_STo_S, n), -n});
  }
  if (!(weights > 0)) return sum;
  sum.depth_m = level_m + soft_width_m * std::log(weights);
  sum.gradient /= weights;
  sum.p_S /= weights;
  return sum;
}

double least_depth_m(const DepthSource& coarse, double margin_m, double soft_width_m, bool is_at_edge) noexcept {
  const double floor_m = coarse.depth_m - margin_m;
  return is_at_edge ? std::max(floor_m, std::min(coarse.depth_m, 0.0) - kApartWidths * soft_width_m) : floor_m;
}

double keep_above(Contact& contact, const DepthSource& coarse, double floor_m, double soft_width_m,
                  const spatial::Pose& X_WS, bool is_known) noexcept {
  if (ablated(Mechanism::kCoarseDepth)) return 0;
  const double above = (floor_m - contact.depth_m) / soft_width_m;
  const double share = is_known ? 1 / (1 + std::exp(-above)) : 1;
  if (!(share > kNoShare) || !std::isfinite(coarse.depth_m)) return 0;
  const spatial::Wrench g_S = spatial::wrench_from(coarse.gradient);
  const spatial::Vector6 gradient =
      spatial::to_vector6(spatial::Wrench{spatial::rotate(X_WS, g_S.torque_Nm), spatial::rotate(X_WS, g_S.force_N)});
  const glm::dvec3 p_W = spatial::transform_point(X_WS, coarse.p_S);
  if (is_known) {
    contact.depth_m = std::max(floor_m, contact.depth_m) + soft_width_m * std::log1p(std::exp(-std::abs(above)));
    contact.gradient = (1 - share) * contact.gradient + share * gradient;
    contact.p_WC_W = glm::mix(contact.p_WC_W, p_W, share);
  } else {
    contact.depth_m = floor_m;
    contact.gradient = gradient;
    contact.p_WC_W = p_W;
  }
  return share;
}

bool confirms_gap(std::span<const collision::ProximityPair> pairs, double depth_m) noexcept {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ProximityPair& pair : pairs) nearest_m = std::min(nearest_m, pair.distance_m);
  return depth_m < 0 && std::abs(nearest_m + depth_m) < kSameGap_m;
}

}  // namespace farfeel::contact
