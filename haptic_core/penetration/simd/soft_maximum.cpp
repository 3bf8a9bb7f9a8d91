// The soft maximum: sums over the cells that a search leaves, over nodes in them, or over the cells that were summed
// the last time.
#include <algorithm>
#include <cmath>

#include "haptic_core/counting/work.h"
#include "haptic_core/penetration/simd/finished_sums.h"
#include "haptic_core/penetration/simd/narrow.h"
#include "haptic_core/penetration/simd/simd_back_end.h"

namespace farfeel::penetration {
namespace {

/// Of a level after the first: where more weigh, some are drawn to stand for the others.
constexpr std::size_t kMostCells = 6'000, kMostCellsApart = 300;
/// The midpoint rule on a peak of standard deviation sigma errs by 2 exp(-2 (pi sigma / step)^2): 0.6 % at 1.85 sigma.
/// Where many peaks touch, their errors differ and make up for each other.
constexpr double kQuadratureError = 6e-3, kMostStepWidths = 2.6, kWidthsSquaredOfPeak = 12;
/// Cells further below the peak weigh about 1e-4 in all and are left out, but for Memory::tail_more.
constexpr double kTailWidths = 9;
/// The second derivative is a spread of slopes over w: far peaks count more in it, and so do the places of the nodes.
constexpr double kTailWidthsOfHessian = 15, kStepWidthsOfHessian = 1.1;
/// Share of the integral that a level may leave out.
constexpr double kLeftOut = 1e-3;
constexpr double kSiftedSteps = 6.5;        ///< cells larger than so many of the last steps are sifted, not sampled,
constexpr std::size_t kMostSifted = 2'000;  ///< while they are no more than this
/// Surfaces farther apart are felt by nobody yet: coarser steps will do, and no doubt is said where what lies between
/// them is that far, too.
constexpr double kApart_m = 0.3e-3;
constexpr double kApartStepWidths = 6;
/// Of the finer surface: no step is longer. From texel to texel second derivatives jump.
constexpr double kMostTexels = 8, kMostTexelsOfHessian = 0.6;
/// Nodes are summed in cells of a level that are no larger than so many of their steps: one more level costs as much as
/// it saves then.
constexpr double kMostLaid = 3.01;
/// What a level's cells say of a peak makes it narrower than it is. So nodes are laid first as if so few were enough,
/// and tell whether they are; but not where more than this share is at a patch's edge: what rises towards it may lie
/// between them.
constexpr std::size_t kFewNodes = 500;
constexpr double kMostAtEdge = 0.15;
constexpr int kMostTrials = 4;             ///< of a step that may turn out too long
constexpr double kLeastOverlap_m = -1e20;  ///< anything that is known
/// A new step is one of a ladder of four to an octave: so searches of much the same contact sum the same nodes.
constexpr double kStepsAnOctave = 4;

/// What the fade leaves so far from an edge.
double kept_at_edge(double distance_m) {
  const double x = distance_m / kEdgeFade_m;
  return x * x * (3 - 2 * x);
}

/// Step in standard deviations of a peak, for an area of so many of their squares.
double step_widths(double area) {
  const double peaks = std::max(1.0, area / kWidthsSquaredOfPeak);
  const double each = std::min(kQuadratureError * std::sqrt(peaks), 1.0);  // may err by so much
  return std::min(kMostStepWidths, M_PI * std::sqrt(2 / std::log(2 / each)));
}

/// The step of the ladder that suits where target_m is just fine enough.
double new_step_m(double target_m) {
  return std::exp2(std::floor(kStepsAnOctave * std::log2(kNewShare * target_m)) / kStepsAnOctave);
}

}  // namespace

double SimdBackEnd::tail_of(const Query& query) const noexcept {
  return query.soft_width_m * (query.wants_hessian ? kTailWidthsOfHessian : kTailWidths + tail_more_);
}

simd::SumTask SimdBackEnd::sum_task(const Query& query, std::size_t count) const noexcept {
  const double w = query.soft_width_m;
  return {.s = search_.s_side(),
          .t = search_.t_side(),
          .count = static_cast<std::int32_t>(count),
          .step = narrow(search_.step_m()),
          .low = {narrow(query.window.low.x), narrow(query.window.low.y)},
          .high = {narrow(query.window.high.x), narrow(query.window.high.y)},
          .width = narrow(w),
          .level = narrow(search_.best_m()),
          .fade = narrow(kEdgeFade_m),
          .per_width = narrow(1 / w),
          .deepest = narrow(std::min(query.deepest_m, 1e6)),
          .tail = narrow(tail_of(query)),
          .near = narrow(CellSearch::kNearWidths * w),
          .faded = narrow(CellSearch::kFadedWidths * w),
          .nearer = narrow(search_.nearer_m()),
          .outermost = narrow(-w * std::log(kept_at_edge(CellSearch::kVeryEdge_m))),
          .To = {narrow(query.t.X_CO.p.x), narrow(query.t.X_CO.p.y), narrow(query.t.X_CO.p.z)},
          .wants_hessian = query.wants_hessian || query.estimates_hessian};
}

Penetration SimdBackEnd::sum_up(const Query& query, const Spread& spread) noexcept {
  const std::size_t count = search_.count(),
                    padded = (count + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes;
  const simd::LaneCells& cells = search_.cells();
  for (std::size_t k = count; k < padded; ++k) {
    cells.overlap[k] = simd::kNowhere;
    cells.u[k] = cells.u[0], cells.v[k] = cells.v[0], cells.stands[k] = 1;
  }
  const simd::SumTask task = sum_task(query, padded);
  counting::count(Work::kSamples, count);
  if (task.wants_hessian) counting::count(Work::kSecondSamples, count);
  simd::Sums sums{};
  kernels_.add_up(task, cells, sums);
  return finished(sums, static_cast<double>(task.level), query.soft_width_m, task.wants_hessian, spread);
}

double SimdBackEnd::step_for_width(const Query& query, double width_m) const noexcept {
  const double area_m2 = static_cast<double>(search_.sampled()) * search_.step_m() * search_.step_m();
  const double widths = search_.best_m() < -kApart_m ? kApartStepWidths
                        : query.wants_hessian        ? kStepWidthsOfHessian
                                                     : step_widths(area_m2 / (width_m * width_m));
  const double texels = query.wants_hessian ? kMostTexelsOfHessian : kMostTexels;
  return std::min(width_m * widths, texels * search_.finest_texel_m());
}

Penetration SimdBackEnd::summed_again(const Query& query, KeptCells& kept, double& target_m) noexcept {
  KeptCells::Place place{};
  if (query.wants_hessian || !kept.still_hold(query, place)) return {};
  search_.resume(kept, place);
  search_.expect_best(kept.best_m(place));
  const simd::SumTask task = sum_task(query, search_.count());
  CellSearch::Summed summed;
  if (!search_.add_up_at_once(task, summed, nullptr)) return {};
  target_m = step_for_width(query, summed.peak_width_m);
  if (!resolves(target_m)) return {};
  kept.note_best(summed.best_m, place);
  return finished(summed.sums, static_cast<double>(task.level), query.soft_width_m, task.wants_hessian, kept.spread());
}

void SimdBackEnd::keep(const Query& query, const Penetration& answer, const CellSearch::Summed& summed,
                       const Spread& spread, const simd::CellStore& store, KeptCells& kept) noexcept {
  // Where the window cuts a contact off, the peak is none of the surfaces', and leaps as they move.
  if (!answer.is_known() || (answer.doubts & kBorder) != 0 || store.count > store.room) return;
  const double to_edges_m = search_.way_to_edges_m(tail_of(query), query.soft_width_m);
  kept.keep(query,
            {.p_CQ = answer.p_CQ_C,
             .searched = search_.window(),
             .step_m = search_.step_m(),
             .best_m = summed.best_m,
             .nearer_m = search_.nearer_m(),
             .least_way_m = std::min({summed.least_way_m, search_.least_way_m(), to_edges_m}),
             .least_way_at_edge_m = (summed.is_at_very_edge ? kHiddenAtEdge : 1) * summed.least_near_way_m,
             .is_at_edge = summed.is_at_edge,
             .spread = spread},
            store.count);
}

Penetration SimdBackEnd::summed_at_middles(const Query& query, const Spread& spread, KeptCells& kept) noexcept {
  search_.lay_middles();
  const simd::SumTask task = sum_task(query, search_.count());
  CellSearch::Summed summed;
  simd::CellStore store = kept.store(task.level - task.tail);
  if (!search_.add_up_at_once(task, summed, &store)) {
    search_.take_up();
    return {};
  }
  const Penetration answer =
      finished(summed.sums, static_cast<double>(task.level), query.soft_width_m, task.wants_hessian, spread);
  keep(query, answer, summed, spread, store, kept);
  return answer;
}

Penetration SimdBackEnd::summed_in_kept(const Query& query, const Laying& laying, KeptCells& kept,
                                        double& target_m) noexcept {
  const double w = query.soft_width_m;
  double step_m = laying.step_m;
  if (step_m < kLeastStep_m || search_.step_m() > kMostLaid * step_m ||
      !search_.lay(step_m, tail_of(query), laying.most))
    return {};
  for (int trial = 0; trial < kMostTrials; ++trial) {
    const simd::SumTask task = sum_task(query, search_.count());
    CellSearch::Summed summed;
    simd::CellStore store = kept.store(task.level - task.tail);
    if (!search_.add_up_at_once(task, summed, &store)) {
      if (summed.best_m < kLeastOverlap_m) break;
      search_.expect_best(summed.best_m);
      continue;
    }
    target_m = step_for_width(query, summed.peak_width_m);
    if (!resolves(target_m)) {
      step_m = std::min(new_step_m(target_m), search_.sampled() < kLeastCells ? 0.5 * step_m : step_m);
      if (step_m < kLeastStep_m || !search_.lay_again(step_m, tail_of(query), laying.most)) break;
      continue;
    }
    const Spread spread{laying.drawn_m, step_m, search_.rough_share(w)};
    const Penetration answer = finished(summed.sums, static_cast<double>(task.level), w, task.wants_hessian, spread);
    // What is seen by chance is seen better by more nodes.
    if (spread.rough > 0 && (answer.doubts & kCoarseSteps) != 0 && trial + 1 < kMostTrials &&
        search_.lay_again(0.5 * step_m, tail_of(query), laying.most)) {
      step_m *= 0.5;
      continue;
    }
    keep(query, answer, summed, spread, store, kept);
    return answer;
  }
  search_.take_up();
  return {};
}

Penetration SimdBackEnd::soft_maximum(const Query& query, KeptCells& kept, double& target_m) noexcept {
  const double known_m = target_m;
  const double w = query.soft_width_m, tail_m = tail_of(query);
  if (!query.wants_hessian) kept.drop();
  // As long as cells are much larger than they will have to be, samples of them tell little.
  while (known_m > 0 && search_.step_m() > kSiftedSteps * known_m) {
    search_.sift(tail_m, w);
    if (search_.kept().empty()) return {};
    if (4 * search_.kept().size() > kMostSifted) break;
    search_.divide(tail_m);
  }
  bool is_coarse = false;
  double drawn_m = 0;
  while (true) {
    search_.look(tail_m, w);
    const double width_m = search_.keep_what_weighs(tail_m, w, kLeftOut);
    const std::size_t left = search_.kept().size();
    if (left == 0) return {};
    target_m = step_for_width(query, width_m);
    const double step_m = search_.step_m();
    const std::size_t most = search_.best_m() < -kApart_m ? kMostCellsApart
                             : query.wants_hessian        ? CellSearch::kMostCells
                                                          : kMostCells;
    if (resolves(target_m) && !search_.may_hide_a_peak(step_m, w)) break;
    is_coarse = step_m < kLeastStep_m || (search_.best_m() < -kApart_m && 4 * left > most);
    if (is_coarse) break;
    if (!query.wants_hessian) {
      const double fine_m = new_step_m(target_m),
                   few_m = new_step_m(step_m * std::sqrt(static_cast<double>(left) / static_cast<double>(kFewNodes)));
      const bool tries_few =
          few_m > fine_m && search_.share_at_edge() < kMostAtEdge && !search_.may_hide_a_peak(few_m, w, true);
      if (tries_few || !search_.may_hide_a_peak(std::min(step_m, fine_m), w)) {
        const Penetration answer = summed_in_kept(query, {tries_few ? few_m : fine_m, drawn_m, most}, kept, target_m);
        if (answer.is_known()) return answer;
      }
    }
    // More touches than can be summed: some of it stands for all.
    if (4 * left > most) {
      search_.draw(most / 4, w);
      drawn_m = std::max(drawn_m, step_m);
    }
    search_.divide(tail_m);
  }
  if (is_coarse) target_m = search_.step_m();  // the next search will end there too
  const Spread spread{drawn_m, search_.step_m(), search_.rough_share(w)};
  Penetration answer;
  if (!query.wants_hessian && !is_coarse) answer = summed_at_middles(query, spread, kept);
  if (!answer.is_known()) answer = sum_up(query, spread);
  if (answer.is_known() && is_coarse && search_.most_m() > -kApart_m) answer.doubts |= kCoarseSteps;
  return answer;
}

}  // namespace farfeel::penetration
