#include "haptic_core/penetration/egl/frame_writer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace farfeel::penetration::egl {
namespace {

constexpr double kTailWidths = 9, kTailWidthsOfHessian = 15;  ///< cells further below the peak are left out
/// The midpoint rule on a peak of standard deviation sigma errs by 2 exp(-2 (pi sigma / step)^2): 0.1 % at 1.6.
constexpr double kStepWidths = 1.6, kStepWidthsOfHessian = 1.2;
constexpr double kMostTexels = 8;      ///< of the finer surface: no step is longer
constexpr double kLeastStep_m = 3e-6;  ///< of the first level
constexpr double kHidden_m = 50e-9;    ///< that the hard maximum may miss
constexpr double kNoWidth_m = 1e-9;    ///< for a search in which the fade at edges does not count
constexpr double kLeastCosine = 1e-8, kLeastSquare_m2 = 1e-14;
constexpr double kFar_m = 1e6;  ///< stands for infinity: floats there still add up

std::uint32_t bits(double x) {
  return std::bit_cast<std::uint32_t>(static_cast<float>(x));
}
Word4 floats(double a, double b, double c, double d) {
  return {bits(a), bits(b), bits(c), bits(d)};
}
Word4 floats(const glm::dvec3& a, std::uint32_t w) {
  return {bits(a.x), bits(a.y), bits(a.z), w};
}

/// What rounding leaves of a zero would make products too small for normal floats, which are slow.
glm::dvec3 without_dust(glm::dvec3 axis) {
  for (int k = 0; k < 3; ++k) axis[k] = std::abs(axis[k]) < kLeastCosine ? 0 : axis[k];
  return axis;
}

bool touches(const glm::dvec2& low, const glm::dvec2& high, const Window& window) {
  return low.x <= window.high.x && high.x >= window.low.x && low.y <= window.high.y && high.y >= window.low.y;
}

/// The first level: cells of one size over the window.
struct FirstLevel {
  glm::dvec2 low, step;
  std::uint32_t across, down;
};

FirstLevel raw_grid(const Query& query) {
  const std::uint32_t n = std::clamp(query.samples, 1u, kMaxSamples);
  return {query.window.low, (query.window.high - query.window.low) / static_cast<double>(n), n, n};
}

FirstLevel first_level(const Query& query, const Window& window) {
  const glm::dvec2 size = window.high - window.low;
  const double n = std::clamp(query.samples, 4u, kMaxSamples);
  const double cell_m = std::max(std::max(size.x, size.y) / n, kLeastStep_m);
  const auto cells = [&](double length) {
    return std::max(1u, static_cast<std::uint32_t>(std::ceil(length / cell_m - 1e-6)));
  };
  FirstLevel level{.low = {}, .step = glm::dvec2{cell_m}, .across = cells(size.x), .down = cells(size.y)};
  const glm::dvec2 count{level.across, level.down};
  // Cells stand over the window's edge where that can't matter, else they are shrunk to fit.
  const bool is_limited = window.low.x <= query.window.low.x || window.low.y <= query.window.low.y ||
                          window.high.x >= query.window.high.x || window.high.y >= query.window.high.y;
  if (is_limited) level.step = size / count;
  level.low = 0.5 * (window.low + window.high - level.step * count);
  return level;
}

/// Words one after the other, with the place of the next.
class Words {
 public:
  Words(std::span<Word4> words, std::uint32_t first) : words_(words), first_(first) {}
  void put(const Word4& word) noexcept { words_[used_++] = word; }
  [[nodiscard]] std::uint32_t next() const { return first_ + used_; }

 private:
  std::span<Word4> words_;
  std::uint32_t first_, used_ = 0;
};

void put_facet(Words& words, const Facet& facet, std::uint32_t slot) {
  words.put(floats(facet.plane, slot));
  for (const glm::dvec3& edge : facet.inside) words.put(floats(edge, 0));
}

void put_edge(Words& words, const PatchEdge& edge) {
  const glm::dvec3 along = edge.b_C - edge.a_C;
  const double square = along.x * along.x + along.y * along.y;
  words.put(floats(edge.a_C, square > kLeastSquare_m2 ? bits(1 / square) : 0));
  words.put(floats(along, 0));
}

}  // namespace

std::array<Word4, kChartWords> chart_words(const Facet& facet, const FeltSurface& felt, const SurfacePlace::Chart& at,
                                           const ReliefReach& reach) noexcept {
  static_assert(kBoundsLevels == 8 && kChartWords == 8);
  const glm::dmat3& R = facet.R_HC;
  const geometry::HeightScale& scale = felt.haptic().scale;
  return {floats(without_dust(R[0]), bits(1 / facet.chart->texel_m)),
          floats(without_dust(R[1]), at.heights),
          floats(without_dust(R[2]), facet.chart->columns),
          floats(facet.p_HC_H, facet.chart->rows),
          floats(scale.offset_m, scale.scale_m, felt.most_bend_1_per_m(facet.chart_index), std::hypot(R[2].x, R[2].y)),
          floats(reach.up_m, reach.down_m, reach.most_drift_m, R[2].z < 0 ? -1 : 1),
          Word4{at.levels[0], at.levels[1], at.levels[2], at.levels[3]},
          Word4{at.levels[4], at.levels[5], at.levels[6], at.levels[7]}};
}

FrameWriter::FrameWriter(const Limits& limits) : s_(limits), t_(limits) {
  for (Sorted* sorted : {&s_sorted_, &t_sorted_}) {
    for (auto* column : {&sorted->facets, &sorted->chart_of, &sorted->charts, &sorted->first})
      column->reserve(limits.coarse_triangles);
    for (auto* column : {&sorted->up, &sorted->down, &sorted->drift}) column->reserve(limits.coarse_triangles);
  }
}

/// Facets that touch the window, each chart's together; what a chart's facets may reach, they share.
void FrameWriter::sort(const FacingPatch& patch, const Window& window, Sorted& sorted) noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  sorted.facets.clear(), sorted.chart_of.clear(), sorted.charts.clear(), sorted.first.clear();
  sorted.up.clear(), sorted.down.clear(), sorted.drift.clear();
  sorted.finest_texel_m = kInfinity;
  const std::span<const Facet> facets = patch.facets();
  for (std::uint32_t i = 0; i < facets.size(); ++i) {
    const Facet& facet = facets[i];
    if (!facet.chart || !touches(facet.low, facet.high, window)) continue;
    const auto found = std::find(sorted.charts.begin(), sorted.charts.end(), facet.chart_index);
    const auto slot = static_cast<std::size_t>(found - sorted.charts.begin());
    const auto up = static_cast<float>(facet.reach_up_m), down = static_cast<float>(facet.reach_down_m),
               drift = static_cast<float>(facet.most_drift_m);
    if (found == sorted.charts.end()) {
      sorted.charts.push_back(facet.chart_index), sorted.first.push_back(i);
      sorted.up.push_back(up), sorted.down.push_back(down), sorted.drift.push_back(drift);
      sorted.finest_texel_m = std::min(sorted.finest_texel_m, facet.chart->texel_m);
      continue;
    }
    sorted.up[slot] = std::max(sorted.up[slot], up);
    sorted.down[slot] = std::min(sorted.down[slot], down);
    sorted.drift[slot] = std::max(sorted.drift[slot], drift);
  }
  const auto take = [&](std::uint32_t chart, std::uint32_t slot) {
    for (std::uint32_t i = 0; i < facets.size(); ++i) {
      if (facets[i].chart_index != chart || !touches(facets[i].low, facets[i].high, window)) continue;
      sorted.facets.push_back(i), sorted.chart_of.push_back(slot);
    }
  };
  for (std::uint32_t slot = 0; slot < sorted.charts.size(); ++slot) take(sorted.charts[slot], slot);
  take(geometry::kNoChart, kNoTriangle);
}

std::optional<WrittenContact> FrameWriter::write(const Query& query, const SurfacePlace& s_place,
                                                 const SurfacePlace& t_place, const std::optional<Recall>& recall,
                                                 std::span<Word4> room, std::uint32_t first_word) noexcept {
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return WrittenContact{};
  Window window = query.window;
  for (const FacingPatch* patch : {&s_, &t_}) {
    Window box{glm::dvec2{std::numeric_limits<double>::infinity()},
               glm::dvec2{-std::numeric_limits<double>::infinity()}};
    for (const Facet& facet : patch->facets()) {
      box = {glm::min(box.low, facet.low), glm::max(box.high, facet.high)};
    }
    window = {glm::max(window.low, box.low), glm::min(window.high, box.high)};
  }
  if (!(window.low.x < window.high.x && window.low.y < window.high.y)) return WrittenContact{};
  sort(s_, window, s_sorted_);
  sort(t_, window, t_sorted_);
  if (s_sorted_.facets.empty() || t_sorted_.facets.empty()) return WrittenContact{};

  const std::size_t most = kHeaderWords + kFacetWords * (s_sorted_.facets.size() + t_sorted_.facets.size()) +
                           kChartWords * (s_sorted_.charts.size() + t_sorted_.charts.size()) +
                           kEdgeWords * (s_.edges().size() + t_.edges().size());
  if (most > room.size()) return std::nullopt;

  const bool is_soft = query.soft_width_m > 0 && query.refines, is_raw = !query.refines;
  const FirstLevel level = is_raw ? raw_grid(query) : first_level(query, window);
  const double width_m = is_soft ? query.soft_width_m : kNoWidth_m;
  const double tail_m = is_soft  ? query.soft_width_m * (query.wants_hessian ? kTailWidthsOfHessian : kTailWidths)
                        : is_raw ? 0
                                 : -kHidden_m;
  const double texel_m = std::min(s_sorted_.finest_texel_m, t_sorted_.finest_texel_m);
  const std::uint32_t flags = (is_soft && query.wants_hessian ? kWantsHessian : 0u) | (is_soft ? 0u : kHard) |
                              (is_raw ? kRaw : 0u) | (recall && !is_raw ? kHasRecall : 0u);

  Words words(room.subspan(kHeaderWords), first_word + kHeaderWords);
  const auto put_facets = [&](const FacingPatch& patch, const Sorted& sorted) {
    const std::uint32_t at = words.next();
    for (std::size_t i = 0; i < sorted.facets.size(); ++i)
      put_facet(words, patch.facets()[sorted.facets[i]], sorted.chart_of[i]);
    return at;
  };
  const auto put_charts = [&](const FacingPatch& patch, const Sorted& sorted, const SurfacePlace& place,
                              const FeltSurface& felt) {
    const std::uint32_t at = words.next();
    for (std::size_t slot = 0; slot < sorted.charts.size(); ++slot) {
      const ReliefReach reach{static_cast<double>(sorted.up[slot]), static_cast<double>(sorted.down[slot]),
                              static_cast<double>(sorted.drift[slot])};
      for (const Word4& word :
           chart_words(patch.facets()[sorted.first[slot]], felt, place.charts[sorted.charts[slot]], reach))
        words.put(word);
    }
    return at;
  };
  const auto put_edges = [&](const FacingPatch& patch) {
    const std::uint32_t at = words.next();
    for (const PatchEdge& edge : patch.edges()) {
      if (touches(edge.low, edge.high, window)) put_edge(words, edge);
    }
    return at;
  };
  const std::uint32_t s_facets = put_facets(s_, s_sorted_), t_facets = put_facets(t_, t_sorted_);
  const std::uint32_t s_charts = put_charts(s_, s_sorted_, s_place, *query.s.surface);
  const std::uint32_t t_charts = put_charts(t_, t_sorted_, t_place, *query.t.surface);
  const std::uint32_t s_edges = put_edges(s_), t_edges = put_edges(t_), end = words.next();

  const auto count = [](const Sorted& sorted) { return static_cast<std::uint32_t>(sorted.facets.size()); };
  const glm::dvec2 low = glm::max(query.window.low, glm::dvec2{-kFar_m}),
                   high = glm::min(query.window.high, glm::dvec2{kFar_m});
  room[0] = {s_facets, count(s_sorted_), t_facets, count(t_sorted_)};
  room[1] = {s_edges, (t_edges - s_edges) / kEdgeWords, t_edges, (end - t_edges) / kEdgeWords};
  room[2] = {s_charts, t_charts, flags, level.across | level.down << 16};
  room[3] = floats(level.low.x, level.low.y, level.step.x, level.step.y);
  room[4] = floats(query.t.X_CO.p, bits(width_m));
  room[5] = floats(low.x, low.y, high.x, high.y);
  room[6] =
      floats(std::min(query.deepest_m, kFar_m), std::min(kFar_m, (query.wants_hessian ? 1 : kMostTexels) * texel_m),
             tail_m, query.wants_hessian ? kStepWidthsOfHessian : kStepWidths);
  room[7] = recall ? floats(std::clamp(recall->uv_m.x, window.low.x, window.high.x),
                            std::clamp(recall->uv_m.y, window.low.y, window.high.y), recall->cell_m, 0)
                   : Word4{};
  return WrittenContact{end - first_word, window};
}

}  // namespace farfeel::penetration::egl
