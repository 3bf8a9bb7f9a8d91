// Near pairs of convex pieces -> a handful of contacts that persist from one tool pose to the next.
//
// Kim, Otaduy, Lin and Manocha 2003 merge near pairs by weighted means. Here a pair's direction counts in its distance
// to a cluster, so the two walls of a slot are never averaged; clusters start from the last update's; a pair stays with
// its cluster until another is clearly nearer; and what a cluster reports moves at bounded speed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "haptic_core/collision/proximity.h"
#include "haptic_core/contact/cluster.h"

namespace farfeel::contact {

struct ClusteringOptions {
  std::uint32_t max_clusters = 8;     ///< 1 ... kMaxContacts; when there are more, the nearest are merged
  double radius_in_tolerances = 2;    ///< a cluster reaches about this far across its direction
  double angle_rad = 0.8;             ///< and holds directions up to about this far from its own
  double point_m_per_s = 1;           ///< limit of p_S's motion
  double slew_rad_per_s = 20;         ///< limit of nhat's
  double depth_creep_m_per_s = 0.05;  ///< depth moves no faster than the fastest of all pairs, plus this
  std::uint32_t max_pairs = 16'384;   ///< pairs beyond are ignored
};

/// Deterministic: the same sequence of updates gives the same clusters. One thread at a time.
class Clustering {
 public:
  explicit Clustering(const ClusteringOptions& = {});
  ~Clustering();
  Clustering(Clustering&&) noexcept;
  Clustering& operator=(Clustering&&) noexcept;

  /// Clusters of these pairs, by falling weight. Valid until the next call. Pairs are ordered by (piece_s, piece_t),
  /// as ProximityQuery answers them. dt_s: time since the last update, >= 0.
  /// While a cluster's id lives, p_S moves at most point_m_per_s dt, nhat turns at most slew_rad_per_s dt, and depth
  /// changes at most by what the fastest pair did plus depth_creep_m_per_s dt. How many there are is bounded by
  /// max_clusters alone, since a face may land on several places at once; while no point of the tool moves by more than
  /// about 20 um between updates it changes by at most 2 (tests/property/collision).
  /// Bounded: O(pairs x max_clusters). Realtime-safe.
  [[nodiscard]] std::span<const Cluster> update(std::span<const collision::ProximityPair> pairs, double tolerance_m,
                                                double dt_s) noexcept;

  /// Forgets every cluster; ids begin anew.
  void restart() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::contact
