// The hard maximum: climbed to from the best cell, and proven by cells whose bounds stay below it.
#include <algorithm>

#include "haptic_core/penetration/overlap_view.h"
#include "haptic_core/penetration/simd/simd_back_end.h"

namespace farfeel::penetration {
namespace {

constexpr double kLeastHardStep_m = 2e-6;  ///< no cell is divided below this size
constexpr int kKeptHardLevel = 2;          ///< cells of this level of the search, which begins with zero, are kept

}  // namespace

Penetration SimdBackEnd::hard_maximum(const Query& query, KeptCells& kept, double known_m) noexcept {
  const OverlapView view{search_.s(), search_.t(), query.deepest_m};
  Peak peak;
  bool is_coarse = false;
  KeptCells::Place place{};
  const bool are_kept = kept.still_hold(query, place);
  simd::CellStore store{};
  double kept_step_m = 0, least_way_m = 0;
  if (are_kept) {
    search_.resume(kept, place);
  } else {
    store = kept.store(0);
    search_.tile(query.samples, known_m, kMostNearerHard_m, kNoWidth_m);
  }
  for (int level = are_kept ? kKeptHardLevel + 1 : 0; true; ++level) {
    const double tail_m = level <= kKeptHardLevel ? kMostNearerHard_m : 0;
    search_.look(tail_m, kNoWidth_m);
    const simd::LaneCells& cells = search_.cells();
    const auto best =
        static_cast<std::size_t>(std::max_element(cells.overlap, cells.overlap + search_.count()) - cells.overlap);
    if (best < search_.count() && cells.overlap[best] != simd::kNowhere &&
        static_cast<double>(cells.overlap[best]) > peak.at.d_m + kHidden_m) {
      const Peak next =
          view.climb({cells.u[best], cells.v[best]}, search_.window(), glm::dvec2{search_.step_m()}, false);
      if (next.at.d_m > peak.at.d_m) peak = next;
    }
    search_.raise_best(peak.at.d_m + kHidden_m);
    search_.keep_above(search_.best_m() - tail_m);
    const double step_m = search_.step_m();
    if (level == kKeptHardLevel) {
      search_.store(store);
      kept_step_m = step_m;
      least_way_m = std::min(
          {search_.nearer_m() / search_.steepest(), search_.least_way_m(), search_.way_to_edges_m(tail_m, kNoWidth_m)});
    }
    is_coarse = 4 * search_.kept().size() > CellSearch::kMostCells;
    if (search_.kept().empty() || step_m < kLeastHardStep_m || is_coarse) break;
    search_.divide(tail_m);
  }
  if (peak.at.d_m == kNoOverlapThere_m) return {};
  if (!peak.is_inside) peak = view.climb(peak.uv, search_.window(), glm::dvec2{search_.step_m()}, true);
  Penetration answer = view.hard_maximum(query, peak);
  if (is_coarse) answer.doubts |= kCoarseSteps;
  if (!are_kept && kept_step_m > 0 && (answer.doubts & kBorder) == 0 && store.count <= store.room) {
    kept.keep(query,
              {.p_CQ = answer.p_CQ_C,
               .searched = search_.window(),
               .step_m = kept_step_m,
               .best_m = peak.at.d_m,
               .nearer_m = search_.nearer_m(),
               .least_way_m = least_way_m,
               .least_way_at_edge_m = kHiddenAtEdge * least_way_m,
               .is_at_edge = !peak.is_inside,
               .spread = {}},
              store.count);
  }
  return answer;
}

}  // namespace farfeel::penetration
