#include "haptic_core/penetration/cell_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::penetration {
namespace {

/// First-level cells stand in blocks of this many squared: a vector of them covers a compact place.
constexpr std::uint32_t kBlock = 4;
static_assert(kBlock * kBlock == simd::kMostLanes);
constexpr std::uint32_t kMostAcross = 120;  ///< first cells along a side
/// Width of the first level's cells, in texels of the finer surface; wider where a recalled sample prunes them.
constexpr double kFirstTexels = 5, kRecalledTexels = 7;
constexpr double kBinsAWidth = 8;      ///< layers below the best, to a soft width
constexpr double kLeftOut = 1e-3;      ///< share of the integral that a level may leave out
constexpr double kLeastSeen = 0.2;     ///< of the best sample's own weight, before cells tell anything of the peak
constexpr double kNearWidths = 4;      ///< cells this near the best decide how sharp the peak is
constexpr double kFadedWidths = 0.05;  ///< lost to the fade: then a cell is near an edge
constexpr double kEdgeShare = 0.02;    ///< of the weight near a patch's edge: then the fade must be resolved too,
constexpr double kFadeWidths = 5;      ///< as so many widths

/// The number whose only factors are twos and perhaps one three, nearest to what suits recalled samples.
double parts_towards(double ratio) {
  const double wanted = kRecalledTexels / kFirstTexels * ratio, twos = std::exp2(std::floor(std::log2(wanted)));
  return wanted < 1.25 * twos ? twos : (wanted < 1.75 * twos && twos > 1 ? 1.5 * twos : 2 * twos);
}

float narrow(double x) {
  return static_cast<float>(x);
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
          .sharp = c[13].data()};
}

CellSearch::CellSearch(const Limits& limits, const simd::Kernels& kernels)
    : kernels_(kernels),
      s_(limits),
      t_(limits),
      s_lanes_(limits, Side::kOutermost),
      t_lanes_(limits, Side::kInnermost),
      listed_(kMostCells + simd::kMostLanes),
      bins_(kMostCells + simd::kMostLanes) {
  kept_.reserve(kMostCells);
  for (std::size_t k = 0; k < fall_.size(); ++k) fall_[k] = std::exp(-static_cast<double>(k) / kBinsAWidth);
}

bool CellSearch::begin(const Query& query) noexcept {
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return false;
  s_lanes_.copy(s_, *query.s.surface);
  t_lanes_.copy(t_, *query.t.surface);
  const Window &s_box = s_lanes_.box(), &t_box = t_lanes_.box();
  window_ = {glm::max(query.window.low, glm::max(s_box.low, t_box.low)),
             glm::min(query.window.high, glm::min(s_box.high, t_box.high))};
  is_limited_ = window_.low.x <= query.window.low.x || window_.low.y <= query.window.low.y ||
                window_.high.x >= query.window.high.x || window_.high.y >= query.window.high.y;
  deepest_m_ = query.deepest_m;
  best_m_ = static_cast<double>(simd::kNowhere);
  return window_.low.x < window_.high.x && window_.low.y < window_.high.y;
}

double CellSearch::finest_texel_m() const {
  return std::min(s_lanes_.finest_texel_m(), t_lanes_.finest_texel_m());
}

void CellSearch::recall(const glm::dvec3& p_CQ, double cell_m) noexcept {
  step_ = glm::dvec2{cell_m};
  for (count_ = 0; count_ < kBlock * kBlock; ++count_) {
    const glm::dvec2 aside{static_cast<double>(count_ % kBlock) - 1.5, static_cast<double>(count_ / kBlock) - 1.5};
    const glm::dvec2 uv = glm::clamp(glm::dvec2{p_CQ} + step_ * aside, window_.low, window_.high);
    cells_.u[count_] = narrow(uv.x);
    cells_.v[count_] = narrow(uv.y);
    cells_.s_z[count_] = cells_.t_z[count_] = std::numeric_limits<float>::quiet_NaN();
  }
  has_parents_ = false;
}

void CellSearch::tile(std::uint32_t samples, double usual_step_m, double tail_m, double soft_width_m) noexcept {
  const glm::dvec2 size = window_.high - window_.low;
  const double n = std::clamp(samples, kBlock, kMostAcross), texel_m = finest_texel_m();
  double cell_m = std::max(std::max(size.x, size.y) / n, std::isinf(texel_m) ? 0 : kFirstTexels * texel_m);
  if (usual_step_m > 0 && usual_step_m < cell_m) cell_m = usual_step_m * parts_towards(cell_m / usual_step_m);
  const auto blocks = [&](double length) {
    return std::max(1u, static_cast<std::uint32_t>(std::ceil(length / (kBlock * cell_m) - 1e-6)));
  };
  std::uint32_t across = blocks(size.x), down = blocks(size.y);
  bool overhangs = !is_limited_;
  while (std::size_t{across} * down * kBlock * kBlock > kMostCells) {
    across = (across + 1) / 2, down = (down + 1) / 2;
    overhangs = false;
  }
  // Cells stand over the window's edge where that can't matter, else they are shrunk to fit.
  step_ = overhangs ? glm::dvec2{cell_m} : size / glm::dvec2{kBlock * across, kBlock * down};
  // A few blocks from all over come first: as the best grows, others are sifted out.
  const glm::dvec2 block = static_cast<double>(kBlock) * step_;
  const glm::dvec2 first = 0.5 * (window_.low + window_.high - block * glm::dvec2{across - 1.0, down - 1.0});
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  count_ = 0;
  for (const bool is_early : {true, false}) {
    for (std::uint32_t j = 0; j < down; ++j) {
      for (std::uint32_t i = 0; i < across; ++i) {
        if (((i + 2 * j) % 5 == 0) != is_early) continue;
        next_.u[count_] = narrow(first.x + block.x * i), next_.v[count_] = narrow(first.y + block.y * j);
        next_.s_z[count_] = next_.t_z[count_] = kUnknown;
        ++count_;
      }
    }
  }
  has_parents_ = false;
  const auto left = static_cast<std::size_t>(kernels_.sift(task_for(count_, block, tail_m, soft_width_m), next_));
  const float step_u = narrow(step_.x), step_v = narrow(step_.y);
  constexpr float kMiddle = 0.5f * (kBlock - 1);
  count_ = 0;
  for (std::size_t b = 0; b < left; ++b) {
    for (std::uint32_t k = 0; k < kBlock * kBlock; ++k, ++count_) {
      cells_.u[count_] = next_.u[b] + step_u * (static_cast<float>(k % kBlock) - kMiddle);
      cells_.v[count_] = next_.v[b] + step_v * (static_cast<float>(k / kBlock) - kMiddle);
      cells_.s_z[count_] = cells_.t_z[count_] = kUnknown;
    }
  }
}

simd::CellTask CellSearch::task_for(std::size_t count, const glm::dvec2& step, double tail_m,
                                    double soft_width_m) noexcept {
  const double reach_m = 0.5 * glm::length(step);
  s_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  t_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  return {.s = s_lanes_.side(),
          .t = t_lanes_.side(),
          .count = static_cast<std::int32_t>(count),
          .half_u = narrow(0.5 * step.x),
          .half_v = narrow(0.5 * step.y),
          .reach = narrow(reach_m),
          .deepest = narrow(std::min(deepest_m_, 1e6)),
          .width = narrow(soft_width_m),
          .fade = narrow(kEdgeFade_m),
          .best = narrow(best_m_),
          .tail = narrow(tail_m),
          .is_last = false};
}

void CellSearch::look(double tail_m, double soft_width_m, bool is_last) noexcept {
  simd::CellTask task = task_for(count_, step_, tail_m, soft_width_m);
  task.is_last = is_last;
  const simd::Seen seen = kernels_.look_at(task, cells_);
  best_m_ = static_cast<double>(seen.best);
  count_ = static_cast<std::size_t>(seen.left);
}

/// Cells that can still matter, and from them how wide the peak is: its curvature as it weighs in the integral, or,
/// where an edge of a patch cuts the peak off, the slope there. (Over a whole peak the mean square of the slope is w
/// times its curvatures' sum, so the two agree where there is no edge.)
double CellSearch::keep_what_weighs(double tail_m, double soft_width_m) noexcept {
  const double lowest_m = std::max(best_m_ - tail_m, 0.99 * static_cast<double>(simd::kNowhere));
  const simd::WeightTask task{
      .count = static_cast<std::int32_t>((count_ + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes),
      .step_u = narrow(step_.x),
      .step_v = narrow(step_.y),
      .best = narrow(best_m_),
      .width = narrow(soft_width_m),
      .lowest = narrow(lowest_m),
      .near = narrow(best_m_ - kNearWidths * soft_width_m),
      .faded = narrow(kFadedWidths * soft_width_m),
      .bins_per_m = narrow(kBinsAWidth / soft_width_m),
      .bins = kBins};
  for (std::size_t k = count_; k % simd::kMostLanes != 0; ++k) cells_.bound[k] = simd::kNowhere;
  simd::Weights weights{};
  const auto listed = static_cast<std::size_t>(kernels_.weigh(task, cells_, listed_.data(), bins_.data(), weights));
  sampled_ = static_cast<std::size_t>(weights.sampled);
  std::array<std::uint32_t, kBins> cells_in{};
  for (std::size_t k = 0; k < listed; ++k) ++cells_in[static_cast<std::size_t>(bins_[k])];
  // Layers are left out from below while all their cells together, at their bounds, weigh next to nothing.
  std::int32_t layers = kBins;
  for (double left_out = 0; layers > 1; --layers) {
    const auto layer = static_cast<std::size_t>(layers - 1);
    left_out += cells_in[layer] * fall_[layer];
    if (left_out > kLeftOut * weights.known) break;
  }
  kept_.resize(listed);  // within its capacity
  std::size_t kept = 0;
  for (std::size_t k = 0; k < listed; ++k) {
    kept_[kept] = static_cast<std::uint32_t>(listed_[k]);
    kept += bins_[k] < layers ? 1 : 0;
  }
  kept_.resize(kept);
  if (weights.near < kLeastSeen) return 0;  // the best was recalled, and no cell's centre comes near it yet
  const double sharp_1_per_m = std::sqrt(weights.square_of_sharpness / weights.near);
  const double width_m = std::sqrt(soft_width_m / std::max(sharp_1_per_m, 1e-9));
  return weights.at_edge > kEdgeShare * weights.near ? std::min(width_m, kEdgeFade_m / kFadeWidths) : width_m;
}

void CellSearch::keep_above(double bound_m) noexcept {
  const float bound = narrow(bound_m);
  kept_.clear();
  for (std::size_t k = 0; k < count_; ++k) {
    if (cells_.bound[k] > bound) kept_.push_back(static_cast<std::uint32_t>(k));
  }
}

void CellSearch::divide(std::uint32_t parts) noexcept {
  const glm::dvec2 step = step_ / static_cast<double>(parts);
  std::size_t count = 0;
  for (const std::uint32_t k : kept_) {
    for (std::uint32_t j = 0; j < parts; ++j) {
      for (std::uint32_t i = 0; i < parts; ++i, ++count) {
        const float du = narrow(step.x * (i + 0.5 - 0.5 * parts)), dv = narrow(step.y * (j + 0.5 - 0.5 * parts));
        next_.u[count] = cells_.u[k] + du;
        next_.v[count] = cells_.v[k] + dv;
        next_.s_z[count] = cells_.s_z[k] + cells_.s_u[k] * du + cells_.s_v[k] * dv;
        next_.t_z[count] = cells_.t_z[k] + cells_.t_u[k] * du + cells_.t_v[k] * dv;
      }
    }
  }
  std::swap(cells_, next_);
  count_ = count;
  step_ = step;
  has_parents_ = true;
}

}  // namespace farfeel::penetration
