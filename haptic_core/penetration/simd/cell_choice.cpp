// Which cells of a level can still matter: by what they weigh, by their bounds, or by lot.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/counting/work.h"
#include "haptic_core/penetration/simd/cell_search.h"
#include "haptic_core/penetration/simd/narrow.h"

namespace farfeel::penetration {
namespace {

constexpr double kLeastSeen = 0.2;  ///< of the best sample's own weight, before cells tell anything of the peak
constexpr double kMostAbove = 20;   ///< soft widths that the best may turn out off what was known of it
/// Of the weight, where a slope and no bend tells how sharp a peak is: then it is a tip. A round peak has 0.37.
constexpr double kPointedShare = 0.7, kPointedWidth = 0.3;  ///< a tip's width, of a round peak's that falls as fast
/// Of the weight near a patch's edge: then the fade must be resolved too, as so many widths. A step as long as the fade
/// sums it to within a fifth.
constexpr double kEdgeShare = 0.03;
constexpr double kFadeWidths = 5;
/// What an edge adds to a sum's error is its share of the weight, times the cube of the step in widths of the fade,
/// whose slope is continuous. So where so much weighs near it, steps may be so much longer; where more does, by the
/// cube root of the shares' ratio, but never shorter than kFadeWidths tells; and where less does, longer in proportion.
constexpr double kLongerAtEdge = 1.6;
/// A peak that the nodes of a sum may miss matters if it rises so many soft widths above the best. From a node to the
/// corner of its cell it bends by more than so many, as the texture's bounds tell, which are none too tight. A trial at
/// a patch's edge takes them as they are, one width: what rises towards the edge from the last node has no further side
/// to be seen from.
constexpr double kHiddenWidths = 2, kHiddenBow = 16, kHiddenBowAtEdge = 1;
/// A cell is drawn by what it weighs at its bound, but no more than so many soft widths above the best, or by what its
/// sample weighs, but no less than so many below, whichever makes its chance greater: half of the cells are drawn for
/// the one, half for the other. By bounds alone those of steep flanks would take nearly all of the places, and by
/// samples alone a peak beside a sample would be missed, or stand for very many.
constexpr double kDrawnAbove = 3, kDrawnBelow = 9, kDrawnByBound = 0.5;
constexpr double kShareOfGap = 0.25;     ///< between edges: what comes out of it comes at once
constexpr double kLevel = 1e-3;          ///< slope that no surface is below: a way is no division by zero
constexpr double kVeryEdgeShare = 0.02;  ///< what an edge that moves leaves out then, or much more where it climbs

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

/// How wide a peak is: its curvature as it weighs in the integral, or, where an edge of a patch cuts the peak off, the
/// slope there. (Over a whole peak the mean square of the slope is w times its curvatures' sum, so the two agree where
/// there is no edge.) 0 while too few cells tell.
double CellSearch::peak_width_m(const simd::Weights& weights, double soft_width_m) noexcept {
  if (weights.near < kLeastSeen) return 0;  // the best was recalled, and no cell's centre comes near it yet
  const double sharp_1_per_m = std::sqrt(weights.square_of_sharpness / weights.near);
  double width_m = std::sqrt(soft_width_m / std::max(sharp_1_per_m, 1e-9));
  if (weights.falling > kPointedShare * weights.near) width_m *= kPointedWidth;
  if (weights.at_edge <= 0) return width_m;
  const double less = kEdgeShare * weights.near / weights.at_edge;  // than kEdgeShare weighs there
  const double longer = std::max(kLongerAtEdge * (less > 1 ? less : std::cbrt(less)), 1.0);
  return std::min(width_m, longer * kEdgeFade_m / kFadeWidths);
}

bool CellSearch::add_up_at_once(const simd::SumTask& task, Summed& summed, simd::CellStore* store) noexcept {
  const auto count = static_cast<std::uint64_t>(task.count);
  counting::count(Work::kSamples, count);
  if (task.wants_hessian) counting::count(Work::kSecondSamples, count);
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
  share_at_edge_ = weights.near > 0 ? weights.in_fade / weights.near : 1;
  return peak_width_m(weights, soft_width_m);
}

double CellSearch::steepest() const noexcept {
  float square = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    square = std::max(square, std::max(cells_.s_u[k] * cells_.s_u[k] + cells_.s_v[k] * cells_.s_v[k],
                                       cells_.t_u[k] * cells_.t_u[k] + cells_.t_v[k] * cells_.t_v[k]));
  }
  return std::max(std::sqrt(static_cast<double>(square)), kLevel);
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
      // Nowhere does the one lie higher above the other than from its upper end to the other's lower one.
      if (!(std::max(a.a_C.z, a.b_C.z) > std::min(b->a_C.z, b->b_C.z) + matters_m) || !meet(a.low, a.high, *b))
        continue;
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

bool CellSearch::may_hide_a_peak(double step_m, double soft_width_m, bool is_trial) const noexcept {
  const double share = step_m / step_m_, most = is_trial && share_at_edge_ > kEdgeShare ? kHiddenBowAtEdge : kHiddenBow;
  const float matters = narrow(best_m_ + kHiddenWidths * soft_width_m),
              bow = narrow(most * soft_width_m / (share * share));
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

double CellSearch::most_m() const noexcept {
  float most = simd::kNowhere;
  for (const std::uint32_t k : kept_) most = std::max(most, cells_.bound[k]);
  return static_cast<double>(most);
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

}  // namespace farfeel::penetration
