// The cells that one answer came from, for the next answers of the same contact: as long as little has moved, those
// that were left out matter as little still, and nothing needs to be searched.
//
// In the frame L of the cells' lattice (C's axes, S's origin in C's plane) both surfaces' points near the contact have
// moved across since, by a_S and a_T, and T has tilted against S by e. Wherever one of the surfaces goes on, the
// overlap at a place has risen by no more than the steeper slope there times (a_S + a_T), plus e R with R the distance
// to the farthest. The search knows by how much each place that it left out lay too low, and how steep it is at most:
// so it says after what way the first of them could matter (least_way_m). Where an edge of S comes to an edge of T no
// surface goes on: there the gap between them says it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/simd/finished_sums.h"
#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::penetration {

class KeptCells {
 public:
  KeptCells();

  /// What a kernel may write cells to.
  [[nodiscard]] simd::CellStore store(float lowest) noexcept;

  /// How the answer came about whose cells were written.
  struct Search {
    glm::dvec3 p_CQ;  ///< its contact point
    Window searched;  ///< the part of the query's window where both surfaces are
    double step_m, best_m;
    double nearer_m;             ///< how much what was left out may come nearer
    double least_way_m;          ///< of the surfaces along each other, that it does so after, at the earliest,
    double least_way_at_edge_m;  ///< and with a patch's edge where they touch
    bool is_at_edge;             ///< a patch's edge is where the surfaces touch
    Spread spread;               ///< of the sum
  };
  void keep(const Query&, const Search&, std::int32_t count) noexcept;
  void drop() noexcept { count_ = 0; }

  /// What is to be added to their centres, and to the guesses of heights there.
  struct Place {
    glm::dvec2 shift_m;
    double s_lift_m, t_lift_m;
  };
  /// Whether they will do for a query, and where they stand then.
  [[nodiscard]] bool still_hold(const Query&, Place&) noexcept;
  /// Another answer came from them.
  void note_best(double best_m, const Place& place) noexcept { level_m_ = best_m - place.s_lift_m + place.t_lift_m; }

  [[nodiscard]] double best_m(const Place& place) const noexcept { return level_m_ + place.s_lift_m - place.t_lift_m; }
  [[nodiscard]] std::int32_t count() const noexcept { return count_; }
  [[nodiscard]] double step_m() const noexcept { return search_.step_m; }
  [[nodiscard]] const Spread& spread() const noexcept { return search_.spread; }
  [[nodiscard]] const float* column(std::size_t k) const noexcept { return columns_[k].data(); }

 private:
  std::array<std::vector<float>, 5> columns_;  // u, v, S's and T's heights, and what they stand for
  std::int32_t count_ = 0;                     // 0: none are kept
  std::uint32_t carried_ = 0;                  // answers since the search
  Search search_{};
  Window window_;  // of the query
  double soft_width_m_ = 0;
  double level_m_ = 0;         // the best, less what has been lifted since
  spatial::Pose X_CS_, X_CT_;  // at the search
  glm::dvec3 p_SQ_{0}, p_TQ_{0};
  double radius_m_ = 0;  // from Q to the farthest place that was searched
  std::uint64_t triangles_ = 0, changes_ = 0;
};

}  // namespace farfeel::penetration
