// Pairs of pieces that have passed through each other.
//
// A flat face is one piece, as thin as a sheet. Two sheets that are pressed together further than they are thick are
// apart again, each behind the other: their distance has no outward direction, and what was pressed would be let go.
// The least translation that leads out of both goes on where it was while they met, and that is what such a pair gets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/collision/moved_vertices.h"
#include "haptic_core/collision/proximity.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

class CrossedSheets {
 public:
  static constexpr double kLeastFacing = 0.2;

  /// The trees must outlive this. Measures how thick the pieces are where the surfaces do not say.
  CrossedSheets(const geometry::HapticSurface& S, const collision::HullTree& tree_s, const geometry::HapticSurface& T,
                const collision::HullTree& tree_t);

  /// The same pairs in the same order (by piece_s, piece_t); those that are apart behind each other, by no more
  /// than a contact may be looked up deep (deepest.h), overlap instead: by the least translation over the admissible
  /// directions, which is what they had while they still met, so that nothing jumps as the last of them passes through.
  /// `facing` fades to nothing where they are nearly that far behind, or the tolerance apart, beyond which no pair
  /// is told of; and where both together are about as thick as the tolerance: what is thicker cannot have passed
  /// through. Those whose facing stays below kLeastFacing are left as they are: no cluster takes them (see
  /// squareness()). Valid as long as `pairs` and until the next call. Realtime-safe.
  [[nodiscard]] std::span<const collision::ProximityPair> mended(std::span<const collision::ProximityPair> pairs,
                                                                 double tolerance_m,
                                                                 const spatial::Pose& X_ST) noexcept;

  /// Of each piece, see geometry/piece_thickness.h; infinite where it is not known.
  [[nodiscard]] std::span<const double> thickness_s_m() const { return thickness_s_m_; }
  [[nodiscard]] std::span<const double> thickness_t_m() const { return thickness_t_m_; }

 private:
  /// A pair that was looked at, by its key.
  struct Tried {
    std::uint64_t key;
    double most_facing, turned_rad;   ///< when it was last worked out
    collision::TranslationAxis axis;  ///< of its least translation, or of one that shows that there is nothing to mend;
                                      ///< unknown where it was not tried
  };

  void place(const spatial::Pose& X_ST) noexcept;
  [[nodiscard]] double most_behind_m(const collision::ProximityPair&) const noexcept;
  [[nodiscard]] bool may_face(Tried&, double near, std::uint32_t piece_s, std::uint32_t piece_t) const noexcept;
  [[nodiscard]] double most_facing(std::uint32_t piece_s, std::uint32_t piece_t) const noexcept;

  const collision::ConvexPieces *s_, *t_;
  collision::MovedVertices t_in_s_, s_in_t_;
  collision::TranslationScratch scratch_;
  std::vector<double> thickness_s_m_, thickness_t_m_;
  std::vector<collision::ProximityPair> mended_;
  std::vector<Tried> tried_, last_tried_;  // in the pairs' order
  double turned_rad_ = 0;                  // T in S, summed over all calls
};

}  // namespace farfeel::contact
