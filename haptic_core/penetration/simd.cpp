// The soft maximum is summed over the cells that a search by branch and bound leaves, once their step resolves the
// peak: so the cost follows the area that touches, not the window. The hard maximum is climbed to from the best cell,
// and proven by cells whose bounds stay below it. While little moves neither is searched again: the soft maximum is
// summed over the cells that weighed the last time, the hard one looked for among those that came near the best.
#include "haptic_core/penetration/simd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/penetration/cell_search.h"
#include "haptic_core/penetration/finished_sums.h"
#include "haptic_core/penetration/overlap_view.h"
#include "haptic_core/penetration/reference.h"

namespace farfeel::penetration {
namespace {

/// Of a level after the first: where more weigh, some are drawn to stand for the others.
constexpr std::size_t kMostCells = 6'000, kMostCellsApart = 300;
/// Cells further below the peak weigh about 1e-4 in all and are left out,
constexpr double kTailWidths = 9;
/// unless the peak is narrow and what lies below it wide: then the depth is below the peak, and cells count that are as
/// much further below, but for this. A tail that is too short by less than kTailSpare, or too long by less than
/// kTailTooLong, is not changed.
constexpr double kDepthBelowPeak = 1, kMostTailMore = 9, kTailSpare = 1, kTailTooLong = 2;
/// The midpoint rule on a peak of standard deviation sigma errs by 2 exp(-2 (pi sigma / step)^2): 0.6 % at 1.85 sigma.
/// Where many peaks touch, their errors differ and make up for each other.
constexpr double kQuadratureError = 6e-3, kMostStepWidths = 2.6, kWidthsSquaredOfPeak = 12;
/// Left-out cells may come so much nearer until contacts are searched anew: those on the flanks of what is summed have
/// about half a percent of the weight then.
constexpr double kMostNearerWidths = 3.5;
/// What a patch covers anew at its edge was never seen. Where some weighs there, it may rise by so much of that.
constexpr double kHiddenAtEdge = 3.0 / 7;
/// The second derivative is a spread of slopes over w: far peaks count more in it, and so do the places of the nodes.
constexpr double kTailWidthsOfHessian = 15, kStepWidthsOfHessian = 1.1;
/// Share of the integral that a level may leave out.
constexpr double kLeftOut = 2e-3, kLeftOutOfHessian = 1e-3;
constexpr double kSiftedSteps = 6.5;        ///< cells larger than so many of the last steps are sifted, not sampled,
constexpr std::size_t kMostSifted = 2'000;  ///< while they are no more than this
constexpr double kApart_m = 0.3e-3;         ///< surfaces farther apart are felt by nobody yet:
constexpr double kApartStepWidths = 6;      ///< coarser steps will do
/// Of the finer surface: no step is longer. From texel to texel second derivatives jump.
constexpr double kMostTexels = 8, kMostTexelsOfHessian = 0.6;
/// Nodes are summed in cells of a level that are no larger than so many of their steps: one more level costs as much as
/// it saves then.
constexpr double kMostLaid = 3.01;
/// What a level's cells say of a peak makes it narrower than it is. So nodes are laid first as if so few were enough,
/// and tell whether they are; but not at a patch's edge, where what rises towards it may lie between them.
constexpr std::size_t kFewNodes = 1'000;
constexpr int kMostTrials = 4;             ///< of a step that may turn out too long
constexpr double kLeastOverlap_m = -1e20;  ///< anything that is known
/// A new step is a little finer than it must be, and one of a ladder of four to an octave: so searches of much the same
/// contact sum the same nodes.
constexpr double kNewShare = 0.87, kStepsAnOctave = 4;
/// The step that a search with second derivatives begins with is kept while it is fine enough, but no finer than this.
constexpr double kMostTooFine = 1.35;
constexpr std::size_t kLeastCells = 10;  ///< of weight that a peak is summed from
constexpr double kLeastStep_m = 3e-6;    ///< cells are divided no further: slopes that run away at an edge ask for any
/// The hard maximum: a cell may hide a peak this much higher than the one found, and is not divided below this size.
constexpr double kHidden_m = 50e-9, kLeastHardStep_m = 2e-6;
constexpr double kMostNearerHard_m = 10e-6;  ///< the same: cells of so much less are kept
constexpr int kKeptHardLevel = 2;            ///< of the search, which begins with zero
constexpr double kNoWidth_m = 1e-9;          ///< for a search in which the fade at edges does not count

const simd::Kernels& kernels_of(InstructionSet wanted) {
#if defined(__x86_64__)
  const bool has_avx512 =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if ((wanted == InstructionSet::kBest || wanted == InstructionSet::kAvx512) && has_avx512) return simd::kAvx512;
  if (wanted != InstructionSet::kPlain && has_avx2) return simd::kAvx2;
#endif
  return simd::kPlain;
}

/// What the fade leaves so far from an edge.
double kept_at_edge(double distance_m) {
  const double x = distance_m / kEdgeFade_m;
  return x * x * (3 - 2 * x);
}

float narrow(double x) {
  return static_cast<float>(x);
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

/// The step to begin with the next time, after `step_m` was taken and target_m would have been fine enough.
double next_step_m(double step_m, double target_m) {
  return step_m <= target_m && target_m <= kMostTooFine * step_m ? step_m : kNewShare * target_m;
}

/// What the last answer to the same contact may be good for now. It decides where a search begins, or that nothing is
/// searched; so a wrong one costs time. What a search sums does not depend on it, but for how far its tail reaches and
/// for second derivatives.
struct Memory {
  std::uint32_t contact = 0;
  const FeltSurface *s = nullptr, *t = nullptr;
  glm::dvec3 p_TQ{0};
  double step_m = 0;             // of the last sum; 0: none
  double step_of_hessian_m = 0;  // resolved the peak, or will, where second derivatives were asked for
  double tail_more = 0;          // soft widths that its tail is longer than others
  KeptCells cells;

  [[nodiscard]] bool is_of(std::uint32_t number, const Query& query) const {
    return contact == number && s == query.s.surface && t == query.t.surface;
  }
  [[nodiscard]] double& step_for(const Query& query) { return query.wants_hessian ? step_of_hessian_m : step_m; }
  void begin(std::uint32_t number, const Query& query) {
    contact = number, s = query.s.surface, t = query.t.surface;
    step_m = step_of_hessian_m = tail_more = 0;
    cells.drop();
  }
  /// Follows what an answer says of the tail. False where it was too short for it.
  bool was_tail_enough(double best_m, double depth_m, double soft_width_m) {
    const double wanted = std::clamp((best_m - depth_m) / soft_width_m - kDepthBelowPeak, 0.0, kMostTailMore);
    const bool is_short = wanted > tail_more + kTailSpare;
    if (is_short || wanted < tail_more - kTailTooLong) tail_more = wanted;
    return !is_short;
  }
};
constexpr std::size_t kMemories = 64;

/// Numbers that differ in their highest bit alone, as those of two widths do, have slots of their own.
std::size_t slot_of(std::uint32_t contact) {
  return (contact ^ contact >> 26) % kMemories;
}

class Simd final : public BackEnd {
 public:
  Simd(const Limits& limits, const simd::Kernels& kernels)
      : kernels_(kernels), grids_(make_reference(limits)), search_(limits, kernels) {}

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if (queries[i].refines) {
        const std::uint32_t contact = queries[i].contact != 0 ? queries[i].contact : static_cast<std::uint32_t>(i);
        answers[i] = answer(queries[i], contact, memories_[slot_of(contact)]);
      } else {
        grids_->evaluate(queries.subspan(i, 1), answers.subspan(i, 1));
      }
    }
  }

  [[nodiscard]] std::uint64_t searches() const noexcept override { return searches_; }

 private:
  Penetration answer(const Query&, std::uint32_t contact, Memory&) noexcept;
  Penetration searched(const Query&, Memory&, double& target_m) noexcept;
  /// How far below the peak cells still count.
  [[nodiscard]] double tail_of(const Query& query) const noexcept {
    return query.soft_width_m * (query.wants_hessian ? kTailWidthsOfHessian : kTailWidths + tail_more_);
  }
  /// The step that resolves a peak of that width.
  [[nodiscard]] double step_for_width(const Query&, double width_m) const noexcept;
  [[nodiscard]] bool resolves(double step_m) const noexcept {
    return search_.step_m() <= step_m && search_.sampled() >= kLeastCells;
  }
  /// From the cells that the last answer was summed from; unknown where they will not do.
  Penetration summed_again(const Query&, KeptCells&, double& target_m) noexcept;
  /// From nodes of a lattice that suits the peak, in the cells that a level has kept; unknown where they are too many
  /// yet.
  struct Laying {
    double step_m;   ///< the first
    double drawn_m;  ///< see Spread
    std::size_t most;
  };
  Penetration summed_in_kept(const Query&, const Laying&, KeptCells&, double& target_m) noexcept;
  /// From the middles of those cells; unknown where what is known of the best is too far off.
  Penetration summed_at_middles(const Query&, const Spread&, KeptCells&) noexcept;
  void keep(const Query&, const Penetration&, const CellSearch::Summed&, const Spread&, const simd::CellStore&,
            KeptCells&) noexcept;
  /// target_m: the step that is expected to resolve the peak; what did.
  Penetration soft_maximum(const Query&, KeptCells&, double& target_m) noexcept;
  /// known_m: the last step of the last search; 0: none.
  Penetration hard_maximum(const Query&, KeptCells&, double known_m) noexcept;
  [[nodiscard]] simd::SumTask sum_task(const Query&, std::size_t count) const noexcept;
  Penetration sum_up(const Query&, const Spread&) noexcept;

  const simd::Kernels& kernels_;
  std::unique_ptr<BackEnd> grids_;  // answers what asks for a raw grid
  CellSearch search_;
  std::array<Memory, kMemories> memories_;
  std::uint64_t searches_ = 0;
  double tail_more_ = 0;  // soft widths; of the contact at hand
};

simd::SumTask Simd::sum_task(const Query& query, std::size_t count) const noexcept {
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

Penetration Simd::sum_up(const Query& query, const Spread& spread) noexcept {
  const std::size_t count = search_.count(),
                    padded = (count + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes;
  const simd::LaneCells& cells = search_.cells();
  for (std::size_t k = count; k < padded; ++k) cells.overlap[k] = simd::kNowhere;
  const simd::SumTask task = sum_task(query, padded);
  simd::Sums sums{};
  kernels_.add_up(task, cells, sums);
  return finished(sums, static_cast<double>(task.level), query.soft_width_m, task.wants_hessian, spread);
}

double Simd::step_for_width(const Query& query, double width_m) const noexcept {
  const double area_m2 = static_cast<double>(search_.sampled()) * search_.step_m() * search_.step_m();
  const double widths = search_.best_m() < -kApart_m ? kApartStepWidths
                        : query.wants_hessian        ? kStepWidthsOfHessian
                                                     : step_widths(area_m2 / (width_m * width_m));
  const double texels = query.wants_hessian ? kMostTexelsOfHessian : kMostTexels;
  return std::min(width_m * widths, texels * search_.finest_texel_m());
}

Penetration Simd::summed_again(const Query& query, KeptCells& kept, double& target_m) noexcept {
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

void Simd::keep(const Query& query, const Penetration& answer, const CellSearch::Summed& summed, const Spread& spread,
                const simd::CellStore& store, KeptCells& kept) noexcept {
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

Penetration Simd::summed_at_middles(const Query& query, const Spread& spread, KeptCells& kept) noexcept {
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

Penetration Simd::summed_in_kept(const Query& query, const Laying& laying, KeptCells& kept, double& target_m) noexcept {
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

Penetration Simd::soft_maximum(const Query& query, KeptCells& kept, double& target_m) noexcept {
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
    const double width_m = search_.keep_what_weighs(tail_m, w, query.wants_hessian ? kLeftOutOfHessian : kLeftOut);
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
      const bool tries_few = few_m > fine_m && !search_.is_at_edge() && !search_.may_hide_a_peak(few_m, w);
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
  if (answer.is_known() && is_coarse) answer.doubts |= kCoarseSteps;
  return answer;
}

Penetration Simd::hard_maximum(const Query& query, KeptCells& kept, double known_m) noexcept {
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

Penetration Simd::searched(const Query& query, Memory& memory, double& target_m) noexcept {
  const bool is_soft = query.soft_width_m > 0;
  const double tail_m = is_soft ? tail_of(query) : 0, width_m = is_soft ? query.soft_width_m : kNoWidth_m;
  ++searches_;
  search_.forget_best();
  if (memory.step_m > 0 || memory.step_of_hessian_m > 0) {
    search_.recall(spatial::transform_point(query.t.X_CO, memory.p_TQ),
                   std::max(memory.step_m, memory.step_of_hessian_m));
    search_.look(tail_m, width_m);
    if (!is_soft) search_.expect_best(search_.best_m() - kHidden_m);  // its own cell's bound may be rounded below it
  }
  // What a depth's nodes are must not depend on what they were.
  const bool forgets = is_soft && !query.wants_hessian;
  target_m = forgets ? 0 : memory.step_for(query);
  if (!is_soft) return hard_maximum(query, memory.cells, target_m);
  search_.tile(query.samples, target_m, tail_m, width_m);
  return soft_maximum(query, memory.cells, target_m);
}

Penetration Simd::answer(const Query& query, std::uint32_t contact, Memory& memory) noexcept {
  const bool is_soft = query.soft_width_m > 0;
  if (!search_.begin(query, is_soft ? kMostNearerWidths * query.soft_width_m : kMostNearerHard_m)) return {};
  if (!memory.is_of(contact, query)) memory.begin(contact, query);
  tail_more_ = memory.tail_more;
  double target_m = 0;
  Penetration answer;
  if (is_soft) answer = summed_again(query, memory.cells, target_m);
  if (!answer.is_known()) answer = searched(query, memory, target_m);
  if (answer.is_known() && is_soft && !query.wants_hessian &&
      !memory.was_tail_enough(search_.best_m(), answer.depth_m, query.soft_width_m)) {
    tail_more_ = memory.tail_more;
    answer = searched(query, memory, target_m);
  }
  if (!answer.is_known()) return answer;
  const glm::dvec2 Q{answer.p_CQ_C};
  if (search_.s().has_several_layers_at(Q) || search_.t().has_several_layers_at(Q)) answer.doubts |= kSeveralLayers;
  memory.p_TQ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C);
  if (query.wants_hessian || !is_soft) {
    memory.step_for(query) = std::max(next_step_m(search_.step_m(), target_m), kLeastStep_m);
  } else {
    memory.step_m = search_.step_m();
  }
  return answer;
}

}  // namespace

std::unique_ptr<BackEnd> make_simd(const Limits& limits, InstructionSet set) {
  return std::make_unique<Simd>(limits, kernels_of(set));
}

const simd::Kernels& simd_kernels(InstructionSet set) {
  return kernels_of(set);
}

std::string_view instruction_set_name(InstructionSet set) {
  return kernels_of(set).name;
}

}  // namespace farfeel::penetration
