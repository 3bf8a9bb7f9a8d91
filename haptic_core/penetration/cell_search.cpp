#include "haptic_core/penetration/cell_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "haptic_core/penetration/window.h"

namespace farfeel::penetration {
namespace {

/// First-level cells stand in blocks of this many squared: a vector of them covers a compact place.
constexpr std::uint32_t kBlock = 4;
static_assert(kBlock * kBlock == simd::kMostLanes);
constexpr std::uint32_t kMostAcross = 120;  ///< first cells along a side
/// Width of the first level's cells, in texels of the finer surface; wider where a recalled sample prunes them.
constexpr double kFirstTexels = 5, kRecalledTexels = 7;
constexpr double kBinsAWidth = 8;   ///< layers below the best, to a soft width
constexpr double kLeastSeen = 0.2;  ///< of the best sample's own weight, before cells tell anything of the peak
constexpr double kMostAbove = 20;   ///< soft widths that the best may turn out off what was known of it
/// Of the weight, where a slope and no bend tells how sharp a peak is: then it is a tip. A round peak has 0.37.
constexpr double kPointedShare = 0.7, kPointedWidth = 0.3;  ///< a tip's width, of a round peak's that falls as fast
/// Of the weight near a patch's edge: then the fade must be resolved too, as so many widths. A step as long as the fade
/// sums it to within a fifth.
constexpr double kEdgeShare = 0.03;
constexpr double kFadeWidths = 5;
/// What an edge adds to a sum's error is its share of the error: where less weighs near it, steps may be so much
/// longer, and longer still in proportion.
constexpr double kLongerAtEdge = 1.6;
/// A peak that the nodes of a sum may miss matters if it rises so many soft widths above the best. From a node to the
/// corner of its cell it bends by more than so many, as the texture's bounds tell, which are none too tight.
constexpr double kHiddenWidths = 2, kHiddenBow = 16;
/// A cell is drawn by what it weighs at its bound, but no more than so many soft widths above the best, or by what its
/// sample weighs, but no less than so many below, whichever makes its chance greater: half of the cells are drawn for
/// the one, half for the other. By bounds alone those of steep flanks would take nearly all of the places, and by
/// samples alone a peak beside a sample would be missed, or stand for very many.
constexpr double kDrawnAbove = 3, kDrawnBelow = 9, kDrawnByBound = 0.5;
constexpr double kShareOfGap = 0.25;     ///< between edges: what comes out of it comes at once
constexpr double kLevel = 1e-3;          ///< slope that no surface is below: a way is no division by zero
constexpr double kVeryEdgeShare = 0.02;  ///< what an edge that moves leaves out then, or much more where it climbs

/// Three times a power of two, near what suits recalled samples: halves that are sifted, and thirds at last.
double parts_towards(double ratio) {
  const double wanted = kRecalledTexels / kFirstTexels * ratio;
  return wanted < 1.7 ? 1 : 3 * std::exp2(std::max(std::round(std::log2(wanted / 3)), 0.0));
}

/// Two edges in C's plane: how far apart, and how much higher the first is there. Those that cross leave no gap that
/// anything could come out of.
struct Gap {
  double wide_m = std::numeric_limits<double>::infinity(), above_m = 0;

  void see(const glm::dvec3& p, const PatchEdge& edge, double sign) {
    const glm::dvec2 a{edge.a_C}, along = glm::dvec2{edge.b_C} - a, to = glm::dvec2{p} - a;
    const double square = glm::dot(along, along);
    const double share = square > 0 ? std::clamp(glm::dot(to, along) / square, 0.0, 1.0) : 0.0;
    const double far_m = glm::length(to - share * along);
    if (far_m < wide_m) wide_m = far_m, above_m = sign * (p.z - glm::mix(edge.a_C.z, edge.b_C.z, share));
  }
};

Gap gap_between(const PatchEdge& a, const PatchEdge& b) {
  const auto side = [](const PatchEdge& of, const glm::dvec3& p) {
    const glm::dvec2 along = glm::dvec2{of.b_C} - glm::dvec2{of.a_C}, to = glm::dvec2{p} - glm::dvec2{of.a_C};
    return along.x * to.y - along.y * to.x > 0;
  };
  Gap gap;
  if (side(a, b.a_C) != side(a, b.b_C) && side(b, a.a_C) != side(b, a.b_C)) return gap;
  gap.see(a.a_C, b, 1), gap.see(a.b_C, b, 1);
  gap.see(b.a_C, a, -1), gap.see(b.b_C, a, -1);
  return gap;
}

float narrow(double x) {
  return static_cast<float>(x);
}

/// The lot of cell (i, j) of a lattice, 0 to 1. Sixteen neighbours, four by four, hold sixteen lots that are evenly
/// apart, in the order of an ordered dither, so that places of much the same chance are drawn evenly; from block to
/// block they are shifted by what is mixed from its place, so that no pattern meets a texture's.
double lot_of(std::int64_t i, std::int64_t j) {
  constexpr std::int64_t kSide = 4;
  constexpr std::array<int, kSide * kSide> kOrder{0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
  std::uint64_t x = static_cast<std::uint64_t>(i >> 2) * 0x9E37'79B9'7F4A'7C15u +
                    static_cast<std::uint64_t>(j >> 2) * 0xBF58'476D'1CE4'E5B9u;
  x ^= x >> 31, x *= 0x94D0'49BB'1331'11EBu, x ^= x >> 29;
  const int order = kOrder[static_cast<std::size_t>((i & (kSide - 1)) + kSide * (j & (kSide - 1)))];
  const double lot = (order + 0.5) / (kSide * kSide) + static_cast<double>(x >> 11) * 0x1p-53;
  return lot - std::floor(lot);
}

/// The weight from which on a cell is kept for certain, where those below are kept with a chance in proportion: so
/// that the sum of min(1, weight / level) is `most`.
double certain_from(const std::vector<float>& weights, std::size_t count, double most) {
  constexpr int kPasses = 8;
  constexpr double kSame = 1e-2;
  double level = 0;
  for (std::size_t n = 0; n < count; ++n) level += static_cast<double>(weights[n]) / most;
  for (int pass = 0; pass < kPasses; ++pass) {
    double below = 0, certain = 0;
    for (std::size_t n = 0; n < count; ++n) {
      const double weight = static_cast<double>(weights[n]);
      if (weight < level) {
        below += weight;
      } else {
        ++certain;
      }
    }
    if (certain >= most) break;
    const double next = below / (most - certain);
    const bool is_same = std::abs(next - level) < kSame * level;
    level = next;
    if (is_same) break;
  }
  return level;
}

}  // namespace

CellSearch::Columns::Columns() {
  for (auto& column : columns_) column.resize(kMostCells + simd::kMostLanes);
}

simd::LaneCells CellSearch::Columns::lanes() {
  auto& c = columns_;
  return {.u = c[0].data(),
          .v = c[1].data(),
          .s_z = c[2].data(),
          .t_z = c[3].data(),
          .s_u = c[4].data(),
          .s_v = c[5].data(),
          .t_u = c[6].data(),
          .t_v = c[7].data(),
          .t_uu = c[8].data(),
          .t_uv = c[9].data(),
          .t_vv = c[10].data(),
          .overlap = c[11].data(),
          .faded = c[14].data(),
          .bound = c[12].data(),
          .sharp = c[13].data(),
          .bow = c[15].data(),
          .stands = c[16].data()};
}

CellSearch::CellSearch(const Limits& limits, const simd::Kernels& kernels)
    : kernels_(kernels),
      s_(limits),
      t_(limits),
      s_lanes_(limits, Side::kOutermost),
      t_lanes_(limits, Side::kInnermost),
      listed_(kMostCells + simd::kMostLanes),
      bins_(kMostCells + simd::kMostLanes),
      at_bound_(kMostCells),
      at_sample_(kMostCells) {
  kept_.reserve(kMostCells);
  t_edges_.reserve(3 * limits.coarse_triangles);
  for (std::size_t k = 0; k < fall_.size(); ++k) fall_[k] = std::exp(-static_cast<double>(k) / kBinsAWidth);
}

bool CellSearch::begin(const Query& query, double nearer_m) noexcept {
  nearer_m_ = nearer_m;
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return false;
  s_lanes_.copy(s_, *query.s.surface);
  t_lanes_.copy(t_, *query.t.surface);
  const Window &s_box = s_lanes_.box(), &t_box = t_lanes_.box();
  window_ = {glm::max(query.window.low, glm::max(s_box.low, t_box.low)),
             glm::min(query.window.high, glm::min(s_box.high, t_box.high))};
  cut_ = query.window;
  p_CS_ = glm::dvec2{query.s.X_CO.p};
  deepest_m_ = query.deepest_m;
  least_way_m_ = static_cast<double>(simd::kEndlessWay);
  best_m_ = static_cast<double>(simd::kNowhere);
  return window_.low.x < window_.high.x && window_.low.y < window_.high.y;
}

double CellSearch::finest_texel_m() const {
  return std::min(s_lanes_.finest_texel_m(), t_lanes_.finest_texel_m());
}

void CellSearch::recall(const glm::dvec3& p_CQ, double cell_m) noexcept {
  step_m_ = cell_m;
  for (count_ = 0; count_ < kBlock * kBlock; ++count_) {
    const glm::dvec2 aside{static_cast<double>(count_ % kBlock) - 1.5, static_cast<double>(count_ / kBlock) - 1.5};
    const glm::dvec2 uv = glm::clamp(glm::dvec2{p_CQ} + step_m_ * aside, window_.low, window_.high);
    cells_.u[count_] = narrow(uv.x);
    cells_.v[count_] = narrow(uv.y);
    cells_.s_z[count_] = cells_.t_z[count_] = std::numeric_limits<float>::quiet_NaN();
    cells_.stands[count_] = 1;
  }
  has_parents_ = false;
}

void CellSearch::tile(std::uint32_t samples, double usual_step_m, double tail_m, double soft_width_m) noexcept {
  const glm::dvec2 size = window_.high - window_.low;
  const double n = std::clamp(samples, kBlock, kMostAcross), texel_m = finest_texel_m();
  double cell_m = std::max(std::max(size.x, size.y) / n, std::isinf(texel_m) ? 0 : kFirstTexels * texel_m);
  if (usual_step_m > 0 && usual_step_m < cell_m) cell_m = usual_step_m * parts_towards(cell_m / usual_step_m);
  // Cells stand on a lattice that S's origin holds, whatever T and the window do: as T moves, what is summed changes as
  // smoothly as the surfaces do.
  glm::dvec2 first, end;
  double block_m = 0;
  for (cell_m *= 0.5; block_m == 0 || (end.x - first.x) * (end.y - first.y) * kBlock * kBlock > kMostCells;) {
    cell_m *= 2;
    block_m = kBlock * cell_m;
    first = glm::floor((window_.low - p_CS_) / block_m), end = glm::ceil((window_.high - p_CS_) / block_m);
  }
  step_m_ = cell_m;
  const auto across = static_cast<std::uint32_t>(end.x - first.x), down = static_cast<std::uint32_t>(end.y - first.y);
  const glm::dvec2 low = p_CS_ + block_m * (first + 0.5);  // the middle of the first block
  // A few blocks from all over come first: as the best grows, others are sifted out.
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  count_ = 0;
  for (const bool is_early : {true, false}) {
    for (std::uint32_t j = 0; j < down; ++j) {
      for (std::uint32_t i = 0; i < across; ++i) {
        if (((i + 2 * j) % 5 == 0) != is_early) continue;
        next_.u[count_] = narrow(low.x + block_m * i), next_.v[count_] = narrow(low.y + block_m * j);
        next_.s_z[count_] = next_.t_z[count_] = kUnknown;
        next_.stands[count_] = 1;
        ++count_;
      }
    }
  }
  has_parents_ = are_sampled_ = false;
  const simd::Seen seen = kernels_.sift(task_for(count_, block_m, tail_m, soft_width_m), next_);
  const auto left = static_cast<std::size_t>(seen.left);
  note_way(static_cast<double>(seen.least_way));
  const float step = narrow(step_m_);
  constexpr float kMiddle = 0.5f * (kBlock - 1);
  count_ = 0;
  for (std::size_t b = 0; b < left; ++b) {
    for (std::uint32_t k = 0; k < kBlock * kBlock; ++k, ++count_) {
      cells_.u[count_] = next_.u[b] + step * (static_cast<float>(k % kBlock) - kMiddle);
      cells_.v[count_] = next_.v[b] + step * (static_cast<float>(k / kBlock) - kMiddle);
      cells_.s_z[count_] = cells_.t_z[count_] = kUnknown;
      cells_.stands[count_] = 1;
    }
  }
}

simd::CellTask CellSearch::task_for(std::size_t count, double step_m, double tail_m, double soft_width_m) noexcept {
  const double reach_m = M_SQRT1_2 * step_m;
  s_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  t_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  return {.s = s_lanes_.side(),
          .t = t_lanes_.side(),
          .count = static_cast<std::int32_t>(count),
          .half = narrow(0.5 * step_m),
          .reach = narrow(reach_m),
          .low = {narrow(cut_.low.x), narrow(cut_.low.y)},
          .high = {narrow(cut_.high.x), narrow(cut_.high.y)},
          .deepest = narrow(std::min(deepest_m_, 1e6)),
          .width = narrow(soft_width_m),
          .fade = narrow(kEdgeFade_m),
          .per_width = narrow(1 / soft_width_m),
          .best = narrow(best_m_),
          .tail = narrow(tail_m),
          .safe = narrow(tail_m - nearer_m_)};
}

void CellSearch::look(double tail_m, double soft_width_m) noexcept {
  const simd::Seen seen = kernels_.look_at(task_for(count_, step_m_, tail_m, soft_width_m), cells_);
  are_sampled_ = true, are_laid_ = false;
  best_m_ = static_cast<double>(seen.best);
  note_way(static_cast<double>(seen.least_way));
  count_ = static_cast<std::size_t>(seen.left);
}

void CellSearch::sift(double tail_m, double soft_width_m) noexcept {
  const simd::Seen seen = kernels_.sift(task_for(count_, step_m_, tail_m, soft_width_m), cells_);
  count_ = static_cast<std::size_t>(seen.left);
  note_way(static_cast<double>(seen.least_way));
  kept_.resize(count_);  // within its capacity
  std::iota(kept_.begin(), kept_.end(), 0u);
  for (std::size_t k = 0; k < count_; ++k) cells_.s_u[k] = cells_.s_v[k] = cells_.t_u[k] = cells_.t_v[k] = 0;
}

/// How wide a peak is: its curvature as it weighs in the integral, or, where an edge of a patch cuts the peak off, the
/// slope there. (Over a whole peak the mean square of the slope is w times its curvatures' sum, so the two agree where
/// there is no edge.) 0 while too few cells tell.
double CellSearch::peak_width_m(const simd::Weights& weights, double soft_width_m) noexcept {
  if (weights.near < kLeastSeen) return 0;  // the best was recalled, and no cell's centre comes near it yet
  const double sharp_1_per_m = std::sqrt(weights.square_of_sharpness / weights.near);
  double width_m = std::sqrt(soft_width_m / std::max(sharp_1_per_m, 1e-9));
  if (weights.falling > kPointedShare * weights.near) width_m *= kPointedWidth;
  if (weights.at_edge <= 0) return width_m;
  const double longer = kEdgeShare * weights.near / weights.at_edge;
  return std::min(width_m, (longer > 1 ? kLongerAtEdge * longer : 1) * kEdgeFade_m / kFadeWidths);
}

void CellSearch::resume(const KeptCells& kept, const KeptCells::Place& place) noexcept {
  count_ = static_cast<std::size_t>(kept.count());
  const auto take = [&](std::size_t column, double more, float* to) {
    const float* from = kept.column(column);
    const float add = narrow(more);
    for (std::size_t k = 0; k < count_; ++k) to[k] = from[k] + add;
  };
  take(0, place.shift_m.x, cells_.u), take(1, place.shift_m.y, cells_.v);
  take(2, place.s_lift_m, cells_.s_z), take(3, place.t_lift_m, cells_.t_z), take(4, 0, cells_.stands);
  step_m_ = kept.step_m();
  has_parents_ = true;
  are_sampled_ = false;
}

void CellSearch::store(simd::CellStore& store) const noexcept {
  if (kept_.size() > static_cast<std::size_t>(store.room)) {
    store.count = store.room + 1;
    return;
  }
  for (const std::uint32_t k : kept_) {
    const auto at = static_cast<std::size_t>(store.count++);
    store.u[at] = cells_.u[k], store.v[at] = cells_.v[k];
    store.s_z[at] = cells_.s_z[k], store.t_z[at] = cells_.t_z[k], store.stands[at] = cells_.stands[k];
  }
}

double CellSearch::steepest() const noexcept {
  float square = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    square = std::max(square, std::max(cells_.s_u[k] * cells_.s_u[k] + cells_.s_v[k] * cells_.s_v[k],
                                       cells_.t_u[k] * cells_.t_u[k] + cells_.t_v[k] * cells_.t_v[k]));
  }
  return std::max(std::sqrt(static_cast<double>(square)), kLevel);
}

bool CellSearch::add_up_at_once(const simd::SumTask& task, Summed& summed, simd::CellStore* store) noexcept {
  simd::Weights weights{};
  summed.sums = {};
  summed.best_m = static_cast<double>(kernels_.sample_and_add(task, cells_, summed.sums, weights, store));
  const double w = static_cast<double>(task.width);
  if (std::abs(summed.best_m - best_m_) > kMostAbove * w) return false;
  sampled_ = static_cast<std::size_t>(weights.sampled);
  summed.peak_width_m = peak_width_m(weights, w);
  summed.is_at_edge = weights.at_edge > kEdgeShare * weights.near;
  summed.is_at_very_edge = weights.outermost > kVeryEdgeShare * weights.near;
  summed.least_way_m = weights.least_way, summed.least_near_way_m = weights.least_near_way;
  return true;
}

double CellSearch::keep_what_weighs(double tail_m, double soft_width_m, double left_out_share) noexcept {
  const double lowest_m = std::max(best_m_ - tail_m, 0.99 * static_cast<double>(simd::kNowhere));
  const simd::WeightTask task{
      .count = static_cast<std::int32_t>((count_ + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes),
      .step = narrow(step_m_),
      .best = narrow(best_m_),
      .width = narrow(soft_width_m),
      .lowest = narrow(lowest_m),
      .safe = narrow(tail_m - nearer_m_),
      .near = narrow(best_m_ - kNearWidths * soft_width_m),
      .faded = narrow(kFadedWidths * soft_width_m),
      .fades = std::min(1.0f, simd::kFadesShare * narrow(kEdgeFade_m / step_m_)),
      .bins_per_m = narrow(kBinsAWidth / soft_width_m),
      .bins = kBins};
  for (std::size_t k = count_; k % simd::kMostLanes != 0; ++k) cells_.bound[k] = simd::kNowhere;
  simd::Weights weights{};
  const auto listed = static_cast<std::size_t>(kernels_.weigh(task, cells_, listed_.data(), bins_.data(), weights));
  sampled_ = static_cast<std::size_t>(weights.sampled);
  note_way(weights.least_way);
  std::array<std::uint32_t, kBins> cells_in{};
  for (std::size_t k = 0; k < listed; ++k) ++cells_in[static_cast<std::size_t>(bins_[k])];
  // Layers are left out from below while all their cells together, at their bounds, weigh next to nothing.
  std::int32_t layers = kBins;
  for (double left_out = 0; layers > 1; --layers) {
    const auto layer = static_cast<std::size_t>(layers - 1);
    left_out += cells_in[layer] * fall_[layer];
    if (left_out > left_out_share * weights.known) break;
  }
  kept_.resize(listed);  // within its capacity
  std::size_t kept = 0;
  for (std::size_t k = 0; k < listed; ++k) {
    kept_[kept] = static_cast<std::uint32_t>(listed_[k]);
    kept += bins_[k] < layers ? 1 : 0;
  }
  kept_.resize(kept);
  is_at_edge_ = weights.in_fade > kEdgeShare * weights.near;
  return peak_width_m(weights, soft_width_m);
}

double CellSearch::way_to_edges_m(double tail_m, double fading_m) noexcept {
  double highest_m = 0, lowest_m = 0;  // of the relief
  for (const Facet& facet : s_.facets()) highest_m = std::max(highest_m, facet.reach_up_m);
  for (const Facet& facet : t_.facets()) lowest_m = std::min(lowest_m, facet.reach_down_m);
  const double matters_m = best_m_ - tail_m + nearer_m_ - highest_m + lowest_m;
  const auto meet = [](const glm::dvec2& low, const glm::dvec2& high, const PatchEdge& edge) {
    return low.x <= edge.high.x && edge.low.x <= high.x && low.y <= edge.high.y && edge.low.y <= high.y;
  };
  t_edges_.clear();  // keeps its capacity
  double bottom_m = std::numeric_limits<double>::infinity();
  for (const PatchEdge& edge : t_.edges()) {
    if (!meet(window_.low, window_.high, edge)) continue;
    t_edges_.push_back(&edge);
    bottom_m = std::min({bottom_m, edge.a_C.z, edge.b_C.z});
  }
  double least_m = static_cast<double>(simd::kEndlessWay);
  for (const PatchEdge& a : s_.edges()) {
    if (!(std::max(a.a_C.z, a.b_C.z) > bottom_m + matters_m) || !meet(window_.low, window_.high, a)) continue;
    for (const PatchEdge* b : t_edges_) {
      if (!meet(a.low, a.high, *b)) continue;
      const Gap gap = gap_between(a, *b);
      const double above_m = gap.above_m - matters_m;
      if (!(above_m > 0)) continue;
      // In a corner of two edges that is x wide both fade: they leave less than 9 (x / 2 fade)^4.
      const double hidden_m = 2 * kEdgeFade_m * std::pow(std::exp(-above_m / fading_m) / 9, 0.25);
      least_m = std::min(least_m, std::max(hidden_m, kShareOfGap * gap.wide_m));
    }
  }
  return least_m;
}

bool CellSearch::may_hide_a_peak(double step_m, double soft_width_m) const noexcept {
  const double share = step_m / step_m_;
  const float matters = narrow(best_m_ + kHiddenWidths * soft_width_m),
              bow = narrow(kHiddenBow * soft_width_m / (share * share));
  return std::any_of(kept_.begin(), kept_.end(),
                     [&](std::uint32_t k) { return cells_.bound[k] > matters && std::abs(cells_.bow[k]) > bow; });
}

double CellSearch::rough_share(double soft_width_m) const noexcept {
  const simd::LaneCells& cells = are_laid_ ? next_ : cells_;
  const double share = are_laid_ ? step_m_ / laid_in_m_ : 1;
  const float near = narrow(best_m_ - soft_width_m), bow = narrow(kHiddenBow * soft_width_m / (share * share));
  std::size_t seen = 0, rough = 0;
  for (const std::uint32_t k : kept_) {
    if (!(cells.bound[k] > near)) continue;
    ++seen;
    rough += std::abs(cells.bow[k]) > bow ? 1 : 0;
  }
  return seen > 0 ? static_cast<double>(rough) / static_cast<double>(seen) : 0;
}

void CellSearch::keep_above(double bound_m) noexcept {
  const float bound = narrow(bound_m);
  kept_.clear();
  for (std::size_t k = 0; k < count_; ++k) {
    if (cells_.bound[k] > bound) {
      kept_.push_back(static_cast<std::uint32_t>(k));
    } else {
      const double slope = std::max(std::hypot(cells_.s_u[k], cells_.s_v[k]), std::hypot(cells_.t_u[k], cells_.t_v[k]));
      note_way((bound_m + nearer_m_ - static_cast<double>(cells_.bound[k])) / std::max(slope, kLevel));
    }
  }
}

void CellSearch::draw(std::size_t most, double soft_width_m) noexcept {
  const std::size_t count = kept_.size();
  if (count <= most) return;
  const float per_width = narrow(1 / soft_width_m), best = narrow(best_m_);
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint32_t k = kept_[n];
    const auto weight = [&](float overlap) { return cells_.stands[k] * std::exp((overlap - best) * per_width); };
    at_bound_[n] = weight(std::min(cells_.bound[k], best + narrow(kDrawnAbove * soft_width_m)));
    at_sample_[n] = weight(std::clamp(cells_.faded[k], best - narrow(kDrawnBelow * soft_width_m), best));
  }
  const double places = static_cast<double>(most),
               certain_bound = certain_from(at_bound_, count, kDrawnByBound * places),
               certain_sample = certain_from(at_sample_, count, (1 - kDrawnByBound) * places);
  const auto place = [this](float at, double origin) {
    return static_cast<std::int64_t>(std::floor((static_cast<double>(at) - origin) / step_m_));
  };
  std::size_t drawn = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint32_t k = kept_[n];
    const double chance = std::max(static_cast<double>(at_bound_[n]) / certain_bound,
                                   static_cast<double>(at_sample_[n]) / certain_sample);
    if (chance < 1) {
      if (lot_of(place(cells_.u[k], p_CS_.x), place(cells_.v[k], p_CS_.y)) >= chance) continue;
      cells_.stands[k] /= narrow(chance);
    }
    kept_[drawn++] = k;
  }
  kept_.resize(drawn);
}

bool CellSearch::lay_in(const simd::LaneCells& cells, const Laying& laying, const simd::LaneCells& places) noexcept {
  const Window cut = laying.half_m > 0 ? kWholePlane : cut_;  // halves of a cell are all of it
  const simd::LayTask task{.origin = {p_CS_.x, p_CS_.y},
                           .cell = laying.cell_m,
                           .step = laying.step_m,
                           .low = {cut.low.x, cut.low.y},
                           .high = {cut.high.x, cut.high.y},
                           .half = narrow(laying.half_m),
                           .lowest = narrow(std::max(best_m_ - laying.tail_m, static_cast<double>(simd::kNowhere))),
                           .chosen = static_cast<std::int32_t>(kept_.size()),
                           .most = static_cast<std::int32_t>(std::min(laying.most, kMostCells))};
  const std::int32_t laid = kernels_.lay(task, cells, kept_.data(), places);
  if (laid > task.most) return false;
  count_ = static_cast<std::size_t>(laid);
  return true;
}

void CellSearch::divide(double tail_m) noexcept {
  const double step_m = 0.5 * step_m_;
  lay_in(cells_, {step_m_, step_m, 0.5 * step_m, tail_m, kMostCells}, next_);
  std::swap(cells_, next_);
  step_m_ = step_m;
  has_parents_ = are_sampled_;
}

bool CellSearch::lay(double step_m, double tail_m, std::size_t most) noexcept {
  const std::size_t cells = count_;
  if (!lay_in(cells_, {step_m_, step_m, 0, tail_m, most}, next_)) return false;
  std::swap(cells_, next_);
  laid_in_m_ = step_m_, step_m_ = step_m;
  laid_in_ = cells;
  are_laid_ = true;
  has_parents_ = are_sampled_;
  return true;
}

bool CellSearch::lay_again(double step_m, double tail_m, std::size_t most) noexcept {
  if (!lay_in(next_, {laid_in_m_, step_m, 0, tail_m, most}, cells_)) return false;
  step_m_ = step_m;
  return true;
}

void CellSearch::lay_middles() noexcept {
  simd::CellStore places{.u = next_.u,
                         .v = next_.v,
                         .s_z = next_.s_z,
                         .t_z = next_.t_z,
                         .stands = next_.stands,
                         .lowest = 0,
                         .room = static_cast<std::int32_t>(kMostCells),
                         .count = 0};
  store(places);
  std::swap(cells_, next_);
  laid_in_m_ = step_m_, laid_in_ = count_, count_ = kept_.size();
  are_laid_ = true;
}

void CellSearch::take_up() noexcept {
  std::swap(cells_, next_);
  step_m_ = laid_in_m_;
  count_ = laid_in_;
  are_laid_ = false;
  are_sampled_ = true;
}

}  // namespace farfeel::penetration
