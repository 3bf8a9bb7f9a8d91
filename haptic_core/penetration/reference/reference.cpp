// A grid of N x N cells finds where the overlap is large; Newton from its best cells finds the peak beyond the grid.
// The soft maximum is then integrated by the midpoint rule over the cells that reach near the peak, each divided until
// the step resolves the peak: its width is sqrt(w / curvature), or w / slope where an edge cuts it off. The grid only
// chooses nodes; the sum's gradient is the exact gradient of the sum.
#include "haptic_core/penetration/reference/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "haptic_core/penetration/overlap_view.h"
#include "haptic_core/penetration/reference/soft_sum.h"

namespace farfeel::penetration {
namespace {

constexpr int kPeaks = 8;              ///< highest local maxima of the grid that are refined
constexpr double kMostDivisions = 96;  ///< of a cell's side
/// Surfaces farther apart than this are felt by nobody yet: a tenth of the nodes will do.
constexpr double kApart_m = 0.2e-3, kApartShare = 0.1;
constexpr int kMostZooms = 2;
constexpr double kLeastTailWidth_m = 1e-6;  ///< the hard maximum keeps this much around the best cell

struct Cell {
  double d_m = kNoOverlapThere_m;      // overlap at the centre
  double slope = 0;                    // there
  double bend_1_per_m = 0;             // there
  double most_m = kNoOverlapThere_m;   // what the overlap inside can't exceed, by the surfaces' relief
  double bound_m = kNoOverlapThere_m;  // what it may well reach inside, from this cell and its neighbours
};

class Reference final : public BackEnd {
 public:
  Reference(const Limits& limits, const ReferenceOptions& options)
      : options_(options), s_(limits), t_(limits), cells_(std::size_t{kMaxSamples} * kMaxSamples) {}

  [[nodiscard]] Traits traits() const noexcept override { return {.has_hessian = true}; }
  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) answers[i] = answer(queries[i]);
  }

 private:
  struct Grid {
    glm::dvec2 low, step;
    std::uint32_t n;
    [[nodiscard]] Window window() const { return {low, low + step * static_cast<double>(n)}; }
    [[nodiscard]] glm::dvec2 centre(std::uint32_t i, std::uint32_t j) const {
      return low + step * glm::dvec2{i + 0.5, j + 0.5};
    }
  };

  Penetration answer(const Query& query) noexcept;
  [[nodiscard]] OverlapView view() const noexcept { return {s_, t_, deepest_m_}; }
  /// Fills the cells; returns the greatest overlap seen.
  double scan(const Grid& grid, double margin_m) noexcept;
  Window active_part(const Grid& grid, double threshold_m) const noexcept;
  Peak best_cell(const Grid& grid) const noexcept;
  Peak highest_peak(const Grid& grid, bool to_the_edge) const noexcept;
  Penetration soft_maximum(const Query& query, const Grid& grid, const Peak& peak) noexcept;
  void add_cell(const Window& cell, std::uint32_t divisions, bool is_at_border, SoftSum& sum) noexcept;

  ReferenceOptions options_;
  FacingPatch s_, t_;
  std::vector<Cell> cells_;
  double deepest_m_ = 0;  // of the query at hand
};

double Reference::scan(const Grid& grid, double margin_m) noexcept {
  const double reach = 0.5 * glm::length(grid.step);
  double best = kNoOverlapThere_m;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      Cell& cell = cells_[j * grid.n + i];
      cell = {};
      const glm::dvec2 uv = grid.centre(i, j);
      const Facet* s = s_.facet_at(uv);
      const Facet* t = s ? t_.facet_at(uv) : nullptr;
      if (!t) continue;
      const double coarse_m = coarse_overlap_m(*s, *t, uv);
      if (coarse_m > deepest_m_) continue;
      // The relief bounds what the texture can add: most of a tilted contact needs no look at it.
      const double most = coarse_m + s->reach_up_m - t->reach_down_m +
                          reach * glm::length(glm::dvec2{s->plane.y - t->plane.y, s->plane.z - t->plane.z});
      cell.most_m = most;
      if (most < best - margin_m) continue;
      Overlap overlap;
      if (!view().of(*s, *t, uv, overlap)) continue;
      cell.d_m = overlap.d_m;
      cell.slope = glm::length(overlap.slope);
      cell.bend_1_per_m = overlap.bend();
      best = std::max(best, overlap.d_m);
    }
  }
  // A ridge narrower than a few cells hides between them: the sharpest neighbour's curvature counts.
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      Cell& cell = cells_[j * grid.n + i];
      if (cell.d_m == kNoOverlapThere_m) continue;
      double bend = 0;
      for (std::uint32_t b = j - (j > 0); b <= std::min(j + 1, grid.n - 1); ++b) {
        for (std::uint32_t a = i - (i > 0); a <= std::min(i + 1, grid.n - 1); ++a) {
          bend = std::max(bend, cells_[b * grid.n + a].bend_1_per_m);
        }
      }
      cell.bound_m = std::min(cell.most_m, cell.d_m + reach * cell.slope + 0.5 * reach * reach * bend);
    }
  }
  // A cell whose centre lies outside a patch may still hold the patch's edge: its neighbours say how high.
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      Cell& cell = cells_[j * grid.n + i];
      if (cell.most_m != kNoOverlapThere_m) continue;
      for (std::uint32_t b = j - (j > 0); b <= std::min(j + 1, grid.n - 1); ++b) {
        for (std::uint32_t a = i - (i > 0); a <= std::min(i + 1, grid.n - 1); ++a) {
          const Cell& beside = cells_[b * grid.n + a];
          if (beside.d_m != kNoOverlapThere_m)
            cell.bound_m = std::max(cell.bound_m, beside.bound_m + 2 * reach * beside.slope);
        }
      }
    }
  }
  return best;
}

Window Reference::active_part(const Grid& grid, double threshold_m) const noexcept {
  std::uint32_t low_i = grid.n, low_j = grid.n, high_i = 0, high_j = 0;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      if (cells_[j * grid.n + i].bound_m < threshold_m) continue;
      low_i = std::min(low_i, i), high_i = std::max(high_i, i + 1);
      low_j = std::min(low_j, j), high_j = std::max(high_j, j + 1);
    }
  }
  // One more cell all round: bounds are estimates.
  const glm::dvec2 low{low_i - std::min(low_i, 1u), low_j - std::min(low_j, 1u)};
  const glm::dvec2 high{std::min(high_i + 1, grid.n), std::min(high_j + 1, grid.n)};
  return {grid.low + low * grid.step, grid.low + high * grid.step};
}

Peak Reference::best_cell(const Grid& grid) const noexcept {
  const auto last = cells_.begin() + static_cast<std::ptrdiff_t>(grid.n) * grid.n;
  const auto best = std::max_element(cells_.begin(), last, [](const Cell& a, const Cell& b) { return a.d_m < b.d_m; });
  const auto k = static_cast<std::uint32_t>(best - cells_.begin());
  Peak peak{.uv = grid.centre(k % grid.n, k / grid.n), .at = {}, .is_inside = true};
  peak.is_inside = view().at(peak.uv, peak.at);
  return peak;
}

Peak Reference::highest_peak(const Grid& grid, bool to_the_edge) const noexcept {
  struct Start {
    double bound_m = kNoOverlapThere_m;
    std::uint32_t i = 0, j = 0;
  };
  std::array<Start, kPeaks> starts;
  const auto value = [&](std::uint32_t i, std::uint32_t j) { return cells_[j * grid.n + i].d_m; };
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      const double d = value(i, j);
      if (d == kNoOverlapThere_m) continue;
      bool is_local = true;
      for (std::uint32_t b = j - (j > 0); b <= std::min(j + 1, grid.n - 1) && is_local; ++b) {
        for (std::uint32_t a = i - (i > 0); a <= std::min(i + 1, grid.n - 1) && is_local; ++a)
          is_local = value(a, b) <= d;
      }
      const Start start{cells_[j * grid.n + i].bound_m, i, j};
      if (!is_local || start.bound_m <= starts.back().bound_m) continue;
      const auto place = std::upper_bound(starts.begin(), starts.end(), start,
                                          [](const Start& x, const Start& y) { return x.bound_m > y.bound_m; });
      std::move_backward(place, starts.end() - 1, starts.end());
      *place = start;
    }
  }
  Peak best;
  for (const Start& start : starts) {
    if (start.bound_m == kNoOverlapThere_m || start.bound_m < best.at.d_m) continue;
    const Peak peak = view().climb(grid.centre(start.i, start.j), grid.window(), grid.step, to_the_edge);
    if (peak.at.d_m > best.at.d_m) best = peak;
  }
  return best;
}

Penetration Reference::soft_maximum(const Query& query, const Grid& grid, const Peak& peak) noexcept {
  const double w = query.soft_width_m;
  // Peak width: the steeper of the two principal curvatures; at an edge, the slope that the edge cuts off.
  const double mean = 0.5 * (peak.at.d_uu + peak.at.d_vv), half = 0.5 * (peak.at.d_uu - peak.at.d_vv);
  const double sharpest = std::max(-(mean - std::hypot(half, peak.at.d_uv)), 1e-6);
  double width_m = std::sqrt(w / sharpest);
  const double slope = glm::length(peak.at.slope);
  if (!peak.is_inside && slope > 0) width_m = std::min(width_m, w / slope);
  if (std::min(s_.fade_at(peak.uv).keep, t_.fade_at(peak.uv).keep) < 1) width_m = std::min(width_m, kEdgeFade_m / 3);

  // Cells far below the peak weigh little: they are divided half and a quarter as finely.
  const auto share = [&](const Cell& cell) {
    const double below_m = peak.at.d_m - cell.bound_m;
    if (!(below_m <= options_.tail_widths * w)) return 0.0;
    return below_m < 0.3 * options_.tail_widths * w ? 1.0 : below_m < 0.6 * options_.tail_widths * w ? 0.5 : 0.25;
  };
  double load = 0;  // nodes for each division squared
  for (std::size_t k = 0; k < std::size_t{grid.n} * grid.n; ++k) load += share(cells_[k]) * share(cells_[k]);
  const double nodes = static_cast<double>(options_.most_nodes) * (peak.at.d_m < -kApart_m ? kApartShare : 1);
  const double wanted = std::max(grid.step.x, grid.step.y) * options_.steps_per_width / width_m;
  const double most = std::clamp(std::sqrt(nodes / load), 1.0, kMostDivisions);
  const double finest = std::clamp(wanted, 1.0, most);

  SoftSum sum(w, peak.at.d_m, query.t.X_CO.p, query.wants_hessian || query.estimates_hessian);
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      const double fineness = share(cells_[j * grid.n + i]);
      if (fineness == 0) continue;
      const bool is_at_border = i == 0 || j == 0 || i + 1 == grid.n || j + 1 == grid.n;
      const glm::dvec2 corner = grid.low + grid.step * glm::dvec2{i, j};
      add_cell({corner, corner + grid.step}, static_cast<std::uint32_t>(std::ceil(fineness * finest)), is_at_border,
               sum);
    }
  }
  Penetration answer = sum.result();
  if (answer.is_known() && wanted > most) answer.doubts |= kCoarseSteps;
  return answer;
}

void Reference::add_cell(const Window& cell, std::uint32_t divisions, bool is_at_border, SoftSum& sum) noexcept {
  s_.narrow(cell);
  t_.narrow(cell);
  const glm::dvec2 step = (cell.high - cell.low) / static_cast<double>(divisions);
  for (std::uint32_t k = 0; k < divisions * divisions; ++k) {
    const glm::dvec2 uv = cell.low + step * glm::dvec2{k % divisions + 0.5, k / divisions + 0.5};
    const Facet* s = s_.narrowed_facet_at(uv);
    const Facet* t = s ? t_.narrowed_facet_at(uv) : nullptr;
    Overlap at;
    if (!t || !view().of(*s, *t, uv, at)) continue;
    sum.add({.uv_m = uv,
             .area_m2 = step.x * step.y,
             .overlap_m = at.d_m,
             .t = at.t,
             .steepest = std::sqrt(
                 std::max(at.s.z_u * at.s.z_u + at.s.z_v * at.s.z_v, at.t.z_u * at.t.z_u + at.t.z_v * at.t.z_v)),
             .s_fade = s_.fade_at(uv),
             .t_fade = t_.fade_at(uv),
             .is_at_border = is_at_border});
  }
}

Penetration Reference::answer(const Query& query) noexcept {
  deepest_m_ = query.deepest_m;
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return {};

  Grid grid{.low = query.window.low, .step = {}, .n = std::clamp(query.samples, 1u, kMaxSamples)};
  grid.step = (query.window.high - query.window.low) / static_cast<double>(grid.n);
  const double tail_m = options_.tail_widths * std::max(query.soft_width_m, kLeastTailWidth_m);
  double best = scan(grid, tail_m);
  if (best == kNoOverlapThere_m) return {};
  if (!query.refines) return view().hard_maximum(query, best_cell(grid));
  // While the cells that matter fill less than half of the grid's side, spend the grid on them alone.
  for (int zoom = 0; zoom < kMostZooms; ++zoom) {
    const Window part = active_part(grid, best - tail_m);
    const glm::dvec2 size = part.high - part.low, whole = grid.step * static_cast<double>(grid.n);
    if (size.x > 0.5 * whole.x && size.y > 0.5 * whole.y) break;
    grid.low = part.low;
    grid.step = size / static_cast<double>(grid.n);
    best = scan(grid, tail_m);
    if (best == kNoOverlapThere_m) return {};
  }
  const Peak peak = highest_peak(grid, query.soft_width_m <= 0);
  Penetration answer = query.soft_width_m > 0 ? soft_maximum(query, grid, peak) : view().hard_maximum(query, peak);
  if (s_.has_several_layers_at(peak.uv) || t_.has_several_layers_at(peak.uv)) answer.doubts |= kSeveralLayers;
  return answer;
}

}  // namespace

std::unique_ptr<BackEnd> make_reference(const Limits& limits, const ReferenceOptions& options) {
  return std::make_unique<Reference>(limits, options);
}

BackEndMaker reference_maker(const ReferenceOptions& options) {
  return [options](const Limits& limits) { return make_reference(limits, options); };
}

}  // namespace farfeel::penetration
