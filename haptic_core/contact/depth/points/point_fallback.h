// Contacts that are no height field along their direction, and what is felt of them instead: points of T's displaced
// surface against S's (point_depth.h).
//
// How much of a contact is felt so is a continuous function of the pose, in [0, 1]: it grows as pieces that lie above
// each other (stacked_pieces.h) come near the tool together, and as the coarse pieces overlap deeper than any relief
// would let the height fields disagree with them. Where no pieces are stacked and the height fields agree, no point is
// looked at.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/collision/proximity.h"
#include "haptic_core/contact/depth/points/point_depth.h"
#include "haptic_core/contact/depth/points/stacked_pieces.h"

namespace farfeel::contact {

struct Contact;

/// One surface made ready: what can be known before anything moves.
struct LayeredSurface {
  LayeredSurface(const penetration::FeltSurface& felt, double reach_m)
      : facets(felt), points(facets), stacked(felt.haptic(), reach_m) {}
  LayeredSurface(const LayeredSurface&) = delete;
  LayeredSurface& operator=(const LayeredSurface&) = delete;

  FacetedSurface facets;
  SurfacePoints points;
  StackedPieces stacked;
};

/// How much of a contact is felt as points, and how that changes with the pose of T about To, in S.
struct PointShare {
  double share = 0;
  spatial::Vector6 gradient = spatial::Vector6::Zero();
};

/// One thread at a time; the surfaces outlive it.
class PointFallback {
 public:
  /// has_points: whether the depth is asked for where there is texture; where there are layers it always is.
  PointFallback(const LayeredSurface& s, LayeredSurface& t, double tolerance_m, bool has_points = true);

  /// Whether S or T has stacked pieces at all.
  [[nodiscard]] bool has_layers() const { return !s_.stacked.is_empty() || !t_.stacked.is_empty(); }
  /// Whether there is a depth to be asked for.
  [[nodiscard]] bool has_points() const { return points_.has_value(); }
  /// By the cluster's stacked pieces. pairs: all near ones of S and T. Realtime-safe.
  [[nodiscard]] PointShare share_by_layers(const Cluster&, std::span<const collision::ProximityPair> pairs,
                                           const glm::dvec3& p_STo_S) noexcept;
  [[nodiscard]] DepthSource depth(const Cluster& cluster, const spatial::Pose& X_ST, double soft_width_m) noexcept {
    return points_ ? points_->evaluate(cluster, X_ST, soft_width_m) : DepthSource{};
  }
  void restart() noexcept {
    if (points_) points_->restart();
  }
  /// Of the last depth.
  [[nodiscard]] std::uint32_t points() const { return points_ ? points_->points() : 0; }

 private:
  /// The pair that presses a piece most, of those that have a piece of the cluster's.
  struct Nearest {
    double weight_m = 0;
    const collision::ProximityPair* pair = nullptr;
  };
  [[nodiscard]] static Nearest nearest_stack(const StackedPieces&, std::span<const std::uint32_t> pieces,
                                             const std::vector<Nearest>&) noexcept;

  const LayeredSurface &s_, &t_;
  double tolerance_m_;
  std::vector<Nearest> nearest_s_, nearest_t_;    // of every piece; empty but for the cluster at hand
  std::vector<std::uint32_t> noted_s_, noted_t_;  // the pieces that have one
  std::vector<std::uint8_t> is_in_s_, is_in_t_;
  std::optional<PointDepth> points_;
};

/// By how far the coarse depth less margin_m is above the height fields' depth that a contact has; all of it where none
/// is known. See keep_above(). Only among coarse pieces that overlap: what is apart pushes nobody yet.
[[nodiscard]] PointShare share_by_floor(const Contact&, bool is_known, const DepthSource&, double margin_m,
                                        const spatial::Pose& X_WS) noexcept;
/// By how far the height fields' depth is above the coarse one and margin_m: pieces that lie above each other are felt
/// through one another.
[[nodiscard]] PointShare share_by_ceiling(const Contact&, const DepthSource&, double margin_m,
                                          const spatial::Pose& X_WS) noexcept;
/// As points by one reason or by the other.
[[nodiscard]] PointShare either(const PointShare&, const PointShare&) noexcept;

/// Two ways of feeling one contact together: depth, gradient, point. The gradient has the share's own part, as far as
/// that is no steeper than the surfaces: what is more, where the two disagree by much, is energy that no force tells
/// of. points: in S; a depth of -infinity counts as apart by apart_m.
void mix_in(Contact&, const PointShare&, const DepthSource& points, double apart_m, const spatial::Pose& X_WS) noexcept;

}  // namespace farfeel::contact
