// All pairs of convex pieces of scene object S and tool T nearer than a tolerance, answered again and again as T moves.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/collision/proximity.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::collision {

/// One for each pair of objects; it remembers the last answer and makes the next one fast. One thread at a time.
/// The trees must outlive it. Distances depend on the pose alone, up to rounding; of several equally good witnesses or
/// directions the last answer's is kept.
class ProximityQuery {
 public:
  /// At most max_pairs are reported (0: as many as there can be, but no more than 16,384).
  ProximityQuery(const HullTree& S, const HullTree& T, std::uint32_t max_pairs = 0);
  ~ProximityQuery();
  ProximityQuery(ProximityQuery&&) noexcept;
  ProximityQuery& operator=(ProximityQuery&&) noexcept;

  /// Every pair with signed distance < tolerance_m, in S's frame, ordered by (piece_s, piece_t). Valid until the next
  /// call. X_ST: T's pose in S. Bounded time, no allocation. Preconditions: tolerance_m > 0, X_ST valid.
  [[nodiscard]] std::span<const ProximityPair> nearer_than(double tolerance_m, const spatial::Pose& X_ST) noexcept;

  /// Forgets the last answers: the next query is as slow as the first. For measurements.
  void restart() noexcept;

  /// Pairs left out since construction because max_pairs was too few. Nothing else is ever left out.
  [[nodiscard]] std::uint64_t pairs_left_out() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::collision
