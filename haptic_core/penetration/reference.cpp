// A grid of N x N cells finds where the overlap is large; Newton from its best cells finds the peak beyond the grid.
// The soft maximum is then integrated by the midpoint rule over the cells that reach near the peak, each divided until
// the step resolves the peak: its width is sqrt(w / curvature), or w / slope where an edge cuts it off. The grid only
// chooses nodes; the sum's gradient is the exact gradient of the sum.
#include "haptic_core/penetration/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "haptic_core/penetration/facing_patch.h"
#include "haptic_core/penetration/pose_derivatives.h"
#include "haptic_core/penetration/soft_sum.h"

namespace farfeel::penetration {
namespace {

constexpr int kPeaks = 8;  ///< highest local maxima of the grid that are refined
constexpr int kNewtonSteps = 12;
constexpr double kMostDivisions = 96;  ///< of a cell's side
/// Surfaces farther apart than this are felt by nobody yet: a tenth of the nodes will do.
constexpr double kApart_m = 0.2e-3, kApartShare = 0.1;
constexpr int kMostZooms = 2;
constexpr double kLeastTailWidth_m = 1e-6;  ///< the hard maximum keeps this much around the best cell
constexpr double kSteepest = 2.7475;        ///< slope of a surface that stands at 70 degrees
constexpr double kNoValue = -std::numeric_limits<double>::infinity();

/// Both surfaces over one point of C's plane.
struct Overlap {
  HeightAlong s, t;
  double d_m = kNoValue;
  glm::dvec2 slope{0};
  double d_uu = 0, d_uv = 0, d_vv = 0;  // [1/m]

  [[nodiscard]] double bend() const { return std::abs(d_uu) + 2 * std::abs(d_uv) + std::abs(d_vv); }
};

struct Cell {
  double d_m = kNoValue;      // overlap at the centre
  double slope = 0;           // there
  double bend_1_per_m = 0;    // there
  double most_m = kNoValue;   // what the overlap inside can't exceed, by the surfaces' relief
  double bound_m = kNoValue;  // what it may well reach inside, from this cell and its neighbours
};

struct Peak {
  glm::dvec2 uv{0};
  Overlap at;
  bool is_inside = false;  // the slope vanishes there; else an edge of a patch or of the window holds it
};

class Reference final : public BackEnd {
 public:
  Reference(const Limits& limits, const ReferenceOptions& options)
      : options_(options), s_(limits), t_(limits), cells_(std::size_t{kMaxSamples} * kMaxSamples) {}

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) answers[i] = answer(queries[i]);
  }

 private:
  struct Grid {
    glm::dvec2 low, step;
    std::uint32_t n;
    [[nodiscard]] glm::dvec2 centre(std::uint32_t i, std::uint32_t j) const {
      return low + step * glm::dvec2{i + 0.5, j + 0.5};
    }
  };

  Penetration answer(const Query& query) noexcept;
  bool overlap_at(const glm::dvec2& uv, Overlap& overlap) const noexcept;
  bool overlap_of(const Facet& s, const Facet& t, const glm::dvec2& uv, Overlap& overlap) const noexcept;
  /// Fills the cells; returns the greatest overlap seen.
  double scan(const Grid& grid, double margin_m) noexcept;
  Window active_part(const Grid& grid, double threshold_m) const noexcept;
  Peak best_cell(const Grid& grid) const noexcept;
  Peak highest_peak(const Grid& grid, bool to_the_edge) const noexcept;
  Peak climb(const glm::dvec2& start, const Grid& grid, bool to_the_edge) const noexcept;
  Penetration hard_maximum(const Query& query, const Peak& peak) const noexcept;
  Penetration soft_maximum(const Query& query, const Grid& grid, const Peak& peak) noexcept;
  void add_cell(const Window& cell, std::uint32_t divisions, bool is_at_border, SoftSum& sum) noexcept;

  ReferenceOptions options_;
  FacingPatch s_, t_;
  std::vector<Cell> cells_;
  double deepest_m_ = 0;  // of the query at hand
};

double coarse_overlap(const Facet& s, const Facet& t, const glm::dvec2& uv) {
  return glm::dot(s.plane - t.plane, glm::dvec3{1, uv});
}

bool Reference::overlap_at(const glm::dvec2& uv, Overlap& overlap) const noexcept {
  const Facet* s = s_.facet_at(uv);
  const Facet* t = s ? t_.facet_at(uv) : nullptr;
  return t && overlap_of(*s, *t, uv, overlap);
}

bool Reference::overlap_of(const Facet& s, const Facet& t, const glm::dvec2& uv, Overlap& overlap) const noexcept {
  if (coarse_overlap(s, t, uv) > deepest_m_) return false;
  overlap.s = s_.height_at(s, uv);
  overlap.t = t_.height_at(t, uv);
  overlap.d_m = overlap.s.z_m - overlap.t.z_m;
  if (std::isnan(overlap.d_m)) return false;
  overlap.slope = {overlap.s.z_u - overlap.t.z_u, overlap.s.z_v - overlap.t.z_v};
  overlap.d_uu = overlap.s.z_uu_1_per_m - overlap.t.z_uu_1_per_m;
  overlap.d_uv = overlap.s.z_uv_1_per_m - overlap.t.z_uv_1_per_m;
  overlap.d_vv = overlap.s.z_vv_1_per_m - overlap.t.z_vv_1_per_m;
  return true;
}

double Reference::scan(const Grid& grid, double margin_m) noexcept {
  const double reach = 0.5 * glm::length(grid.step);
  double best = kNoValue;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      Cell& cell = cells_[j * grid.n + i];
      cell = {};
      const glm::dvec2 uv = grid.centre(i, j);
      const Facet* s = s_.facet_at(uv);
      const Facet* t = s ? t_.facet_at(uv) : nullptr;
      if (!t) continue;
      const double coarse_m = coarse_overlap(*s, *t, uv);
      if (coarse_m > deepest_m_) continue;
      // The relief bounds what the texture can add: most of a tilted contact needs no look at it.
      const double most = coarse_m + s->reach_up_m - t->reach_down_m +
                          reach * glm::length(glm::dvec2{s->plane.y - t->plane.y, s->plane.z - t->plane.z});
      cell.most_m = most;
      if (most < best - margin_m) continue;
      Overlap overlap;
      if (!overlap_of(*s, *t, uv, overlap)) continue;
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
      if (cell.d_m == kNoValue) continue;
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
      if (cell.most_m != kNoValue) continue;
      for (std::uint32_t b = j - (j > 0); b <= std::min(j + 1, grid.n - 1); ++b) {
        for (std::uint32_t a = i - (i > 0); a <= std::min(i + 1, grid.n - 1); ++a) {
          const Cell& beside = cells_[b * grid.n + a];
          if (beside.d_m != kNoValue) cell.bound_m = std::max(cell.bound_m, beside.bound_m + 2 * reach * beside.slope);
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

Peak Reference::climb(const glm::dvec2& start, const Grid& grid, bool to_the_edge) const noexcept {
  Peak peak;
  peak.uv = start;
  if (!overlap_at(start, peak.at)) return peak;
  const glm::dvec2 high = grid.low + grid.step * static_cast<double>(grid.n);
  const double longest_step = glm::length(grid.step);
  double stride = 1;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Overlap& at = peak.at;
    const double determinant = at.d_uu * at.d_vv - at.d_uv * at.d_uv;
    glm::dvec2 move;
    if (at.d_uu < 0 && determinant > 0) {
      move = glm::dvec2{at.d_uv * at.slope.y - at.d_vv * at.slope.x, at.d_uv * at.slope.x - at.d_uu * at.slope.y} /
             determinant;
    } else {
      const double slope = glm::length(at.slope);
      if (!(slope > 0)) break;
      move = at.slope * (0.5 * longest_step / slope);
    }
    const double length = glm::length(move);
    if (length > longest_step) move *= longest_step / length;
    // Halve until it climbs; what cannot climb has arrived, or stands at an edge.
    bool has_climbed = false;
    for (stride = 1; stride > 1e-6; stride *= 0.5) {
      const glm::dvec2 uv = glm::clamp(peak.uv + stride * move, grid.low, high);
      Overlap next;
      if (overlap_at(uv, next) && next.d_m > peak.at.d_m) {
        peak.uv = uv;
        peak.at = next;
        has_climbed = true;
        break;
      }
      if (stride * length < 1e-9) break;
    }
    if (!has_climbed) break;
  }
  peak.is_inside = glm::length(peak.at.slope) < 1e-6 + 1e-7 * peak.at.bend();
  if (peak.is_inside || !to_the_edge) return peak;
  // An edge holds it: walk along whatever direction still climbs, with ever shorter steps.
  const glm::dvec2 corner_step = grid.step * 0.5;
  for (double scale = 1; scale * longest_step > 1e-9;) {
    const glm::dvec2 s_in = s_.fade_at(peak.uv).inward, t_in = t_.fade_at(peak.uv).inward;
    const std::array<glm::dvec2, 4> ways{glm::dvec2{corner_step.x, 0}, glm::dvec2{0, corner_step.y},
                                         0.5 * longest_step * glm::dvec2{-s_in.y, s_in.x},
                                         0.5 * longest_step * glm::dvec2{-t_in.y, t_in.x}};
    bool has_climbed = false;
    for (const glm::dvec2& way : ways) {
      for (const double turn : {scale, -scale}) {
        const glm::dvec2 uv = glm::clamp(peak.uv + turn * way, grid.low, high);
        Overlap next;
        if (overlap_at(uv, next) && next.d_m > peak.at.d_m) {
          peak.uv = uv;
          peak.at = next;
          has_climbed = true;
        }
      }
    }
    if (!has_climbed) scale *= 0.5;
  }
  return peak;
}

Peak Reference::best_cell(const Grid& grid) const noexcept {
  const auto last = cells_.begin() + static_cast<std::ptrdiff_t>(grid.n) * grid.n;
  const auto best = std::max_element(cells_.begin(), last, [](const Cell& a, const Cell& b) { return a.d_m < b.d_m; });
  const auto k = static_cast<std::uint32_t>(best - cells_.begin());
  Peak peak{.uv = grid.centre(k % grid.n, k / grid.n), .at = {}, .is_inside = true};
  overlap_at(peak.uv, peak.at);
  return peak;
}

Peak Reference::highest_peak(const Grid& grid, bool to_the_edge) const noexcept {
  struct Start {
    double bound_m = kNoValue;
    std::uint32_t i = 0, j = 0;
  };
  std::array<Start, kPeaks> starts;
  const auto value = [&](std::uint32_t i, std::uint32_t j) { return cells_[j * grid.n + i].d_m; };
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      const double d = value(i, j);
      if (d == kNoValue) continue;
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
    if (start.bound_m == kNoValue || start.bound_m < best.at.d_m) continue;
    const Peak peak = climb(grid.centre(start.i, start.j), grid, to_the_edge);
    if (peak.at.d_m > best.at.d_m) best = peak;
  }
  return best;
}

Penetration Reference::hard_maximum(const Query& query, const Peak& peak) const noexcept {
  Penetration answer;
  answer.doubts = 0;
  answer.depth_m = peak.at.d_m;
  answer.p_CQ_C = {peak.uv, peak.at.t.z_m};
  const glm::dvec3 r = answer.p_CQ_C - query.t.X_CO.p;
  answer.gradient = overlap_gradient(peak.at.t, r);
  if (!peak.is_inside) {
    // Where T's edge holds the peak the contact travels with T: S's slope counts, at S's edge T's.
    if (t_.fade_at(peak.uv).keep < s_.fade_at(peak.uv).keep) answer.gradient = overlap_gradient(peak.at.s, r);
    return answer;
  }
  if (query.wants_hessian) {
    const Matrix62 slopes = overlap_gradient_slopes(peak.at.t, r);
    const double determinant = peak.at.d_uu * peak.at.d_vv - peak.at.d_uv * peak.at.d_uv;
    answer.hessian = overlap_hessian(peak.at.t, r);
    if (determinant > 0) {  // the peak moves with T: subtract what that adds
      Eigen::Matrix2d inverse;
      inverse << peak.at.d_vv, -peak.at.d_uv, -peak.at.d_uv, peak.at.d_uu;
      answer.hessian -= slopes * (inverse / determinant) * slopes.transpose();
    }
  }
  return answer;
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

  SoftSum sum(w, peak.at.d_m, query.t.X_CO.p, query.wants_hessian);
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
    if (!t || !overlap_of(*s, *t, uv, at)) continue;
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
  if (best == kNoValue) return {};
  if (!query.refines) return hard_maximum(query, best_cell(grid));
  // While the cells that matter fill less than half of the grid's side, spend the grid on them alone.
  for (int zoom = 0; zoom < kMostZooms; ++zoom) {
    const Window part = active_part(grid, best - tail_m);
    const glm::dvec2 size = part.high - part.low, whole = grid.step * static_cast<double>(grid.n);
    if (size.x > 0.5 * whole.x && size.y > 0.5 * whole.y) break;
    grid.low = part.low;
    grid.step = size / static_cast<double>(grid.n);
    best = scan(grid, tail_m);
    if (best == kNoValue) return {};
  }
  const Peak peak = highest_peak(grid, query.soft_width_m <= 0);
  Penetration answer = query.soft_width_m > 0 ? soft_maximum(query, grid, peak) : hard_maximum(query, peak);
  if (query.soft_width_m <= 0) {
    if (std::min(s_.fade_at(peak.uv).keep, t_.fade_at(peak.uv).keep) < 1 && !peak.is_inside)
      answer.doubts |= kSilhouette;
    const double steepness = std::max(glm::length(glm::dvec2{peak.at.s.z_u, peak.at.s.z_v}),
                                      glm::length(glm::dvec2{peak.at.t.z_u, peak.at.t.z_v}));
    if (steepness > kSteepest) answer.doubts |= kGrazing;
    const glm::dvec2 inside = glm::min(peak.uv - query.window.low, query.window.high - peak.uv);
    if (!peak.is_inside && std::min(inside.x, inside.y) < 1e-9) answer.doubts |= kBorder;
  }
  if (s_.has_several_layers_at(peak.uv) || t_.has_several_layers_at(peak.uv)) answer.doubts |= kSeveralLayers;
  return answer;
}

}  // namespace

std::unique_ptr<BackEnd> make_reference(const Limits& limits) {
  return make_reference(limits, ReferenceOptions{});
}

std::unique_ptr<BackEnd> make_reference(const Limits& limits, const ReferenceOptions& options) {
  return std::make_unique<Reference>(limits, options);
}

}  // namespace farfeel::penetration
