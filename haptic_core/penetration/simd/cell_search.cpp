#include "haptic_core/penetration/simd/cell_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "haptic_core/counting/work.h"
#include "haptic_core/penetration/simd/narrow.h"
#include "haptic_core/penetration/window.h"

namespace farfeel::penetration {
namespace {

/// First-level cells stand in blocks of this many squared: a vector of them covers a compact place.
constexpr std::uint32_t kBlock = 4;
static_assert(kBlock * kBlock == simd::kMostLanes);
constexpr std::uint32_t kMostAcross = 120;  ///< first cells along a side
/// Width of the first level's cells, in texels of the finer surface; wider where a recalled sample prunes them.
constexpr double kFirstTexels = 5, kRecalledTexels = 7;

/// Three times a power of two, near what suits recalled samples: halves that are sifted, and thirds at last.
double parts_towards(double ratio) {
  const double wanted = kRecalledTexels / kFirstTexels * ratio;
  return wanted < 1.7 ? 1 : 3 * std::exp2(std::max(std::round(std::log2(wanted / 3)), 0.0));
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

bool CellSearch::project(const Query& query) noexcept {
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
  return window_.low.x < window_.high.x && window_.low.y < window_.high.y;
}

void CellSearch::begin(double nearer_m) noexcept {
  nearer_m_ = nearer_m;
  least_way_m_ = static_cast<double>(simd::kEndlessWay);
  best_m_ = static_cast<double>(simd::kNowhere);
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
  counting::count(Work::kCellsSifted, count_);
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
  counting::count(Work::kCellsLaid, count_);
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
  counting::count(Work::kCellsLooked, count_);
  const simd::Seen seen = kernels_.look_at(task_for(count_, step_m_, tail_m, soft_width_m), cells_);
  are_sampled_ = true, are_laid_ = false;
  best_m_ = static_cast<double>(seen.best);
  note_way(static_cast<double>(seen.least_way));
  count_ = static_cast<std::size_t>(seen.left);
}

void CellSearch::sift(double tail_m, double soft_width_m) noexcept {
  counting::count(Work::kCellsSifted, count_);
  const simd::Seen seen = kernels_.sift(task_for(count_, step_m_, tail_m, soft_width_m), cells_);
  count_ = static_cast<std::size_t>(seen.left);
  note_way(static_cast<double>(seen.least_way));
  kept_.resize(count_);  // within its capacity
  std::iota(kept_.begin(), kept_.end(), 0u);
  for (std::size_t k = 0; k < count_; ++k) cells_.s_u[k] = cells_.s_v[k] = cells_.t_u[k] = cells_.t_v[k] = 0;
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
  counting::count(Work::kCellsLaid, count_);
  std::swap(cells_, next_);
  step_m_ = step_m;
  has_parents_ = are_sampled_;
}

bool CellSearch::lay(double step_m, double tail_m, std::size_t most) noexcept {
  const std::size_t cells = count_;
  if (!lay_in(cells_, {step_m_, step_m, 0, tail_m, most}, next_)) return false;
  counting::count(Work::kNodesLaid, count_);
  std::swap(cells_, next_);
  laid_in_m_ = step_m_, step_m_ = step_m;
  laid_in_ = cells;
  are_laid_ = true;
  has_parents_ = are_sampled_;
  return true;
}

bool CellSearch::lay_again(double step_m, double tail_m, std::size_t most) noexcept {
  if (!lay_in(next_, {laid_in_m_, step_m, 0, tail_m, most}, cells_)) return false;
  counting::count(Work::kNodesLaid, count_);
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
  counting::count(Work::kNodesLaid, count_);
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
