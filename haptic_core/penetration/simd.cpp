// Branch and bound over square cells. Cells of the first level tile the window. The kernel samples the overlap at their
// centres and bounds it inside them; cells that cannot come near the best sample are dropped, the others divided, until
// the cells that are left resolve the peak: their samples are then the quadrature of the soft maximum. So the cost
// follows the area that touches, not the window.
#include "haptic_core/penetration/simd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "haptic_core/penetration/lane_patch.h"
#include "haptic_core/penetration/reference.h"

namespace farfeel::penetration {
namespace {

constexpr std::uint32_t kBlock =
    4;  ///< first-level cells stand in blocks of this many squared: a vector of compact places
static_assert(kBlock * kBlock == simd::kMostLanes);
constexpr std::size_t kMostFirstCells = 16'000, kMostCells = 4'000, kMostCellsApart = 600;  ///< of a level
constexpr std::uint32_t kMostAcross = 120;  ///< first cells along a side
constexpr double kTailWidths = 9;           ///< cells further below the peak weigh about 1e-4 in all and are left out
/// The midpoint rule on a peak of standard deviation sigma errs by 2 exp(-2 (pi sigma / step)^2): 0.8 % at 1.9.
constexpr double kStepWidths = 1.9;
/// The second derivative is a spread of slopes over w: far peaks count more in it, and so do the places of the nodes.
constexpr double kTailWidthsOfHessian = 15, kStepWidthsOfHessian = 1.2;
constexpr double kApart_m = 0.3e-3;     ///< surfaces farther apart are felt by nobody yet:
constexpr double kApartStepWidths = 3;  ///< coarser steps will do
constexpr double kRecalledTexels = 7;
constexpr double kFirstTexels = 5;       ///< width of the first level's cells, in texels of the finer surface
constexpr std::int32_t kBins = 160;      ///< layers of overlap below the best that are told apart,
constexpr double kBinsAWidth = 8;        ///< so many to a soft width
constexpr double kLeftOut = 1e-3;        ///< share of the integral that a level may leave out
constexpr double kLeastSeen = 0.2;       ///< of the best sample's own weight, before cells tell anything of the peak
constexpr double kNearWidths = 4;        ///< cells this near the best decide how sharp the peak is
constexpr float kEdgeWidths = 2;         ///< a peak that an edge cuts off is this much wider, squared, than w / slope
constexpr double kFadedWidths = 0.05;    ///< lost to the fade: then a cell is near an edge
constexpr double kEdgeShare = 0.02;      ///< of the weight near a patch's edge: then the fade must be resolved too,
constexpr double kFadeWidths = 5;        ///< as so many widths
constexpr double kMostTexels = 8;        ///< of the finer surface: no step is longer
constexpr double kUsualShare = 0.95;     ///< of the last step that was fine enough, to aim at the next time
constexpr std::size_t kLeastCells = 24;  ///< that a peak is summed from
constexpr double kLeastStep_m = 3e-6;    ///< cells are divided no further: slopes that run away at an edge ask for any

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

float narrow(double x) {
  return static_cast<float>(x);
}

/// The columns of simd::LaneCells, with their memory.
class Cells {
 public:
  Cells() {
    for (auto& column : columns_) column.resize(kMostFirstCells + simd::kMostLanes);
  }
  [[nodiscard]] simd::LaneCells lanes() {
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

 private:
  std::array<std::vector<float>, 15> columns_;
};

/// What the last answer to the query in the same place of the list may be good for now. It decides only where the
/// search begins and how its cells are laid, so a wrong one costs time and nothing else.
struct Memory {
  const FeltSurface *s = nullptr, *t = nullptr;
  glm::dvec3 p_TQ{0};
  double target_m = 0;  // step that resolved the peak
};
constexpr std::size_t kMemories = 64;

class Simd final : public BackEnd {
 public:
  Simd(const Limits& limits, const simd::Kernels& kernels)
      : kernels_(kernels),
        exact_(make_reference(limits)),
        s_(limits),
        t_(limits),
        s_lanes_(limits, Side::kOutermost),
        t_lanes_(limits, Side::kInnermost) {
    kept_.reserve(kMostFirstCells);
    for (std::size_t k = 0; k < fall_.size(); ++k) fall_[k] = std::exp(-static_cast<double>(k) / kBinsAWidth);
  }

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      if (queries[i].soft_width_m > 0) {
        answers[i] = answer(queries[i], memories_[i % kMemories]);
      } else {
        exact_->evaluate(queries.subspan(i, 1), answers.subspan(i, 1));
      }
    }
  }

 private:
  Penetration answer(const Query&, Memory&) noexcept;
  [[nodiscard]] double first_cell_m(const Window&, std::uint32_t samples, double usual_step_m) const noexcept;
  void tile(const Window&, double cell_m, bool may_overhang) noexcept;
  void recall(const Window&, const glm::dvec3& p_CQ) noexcept;
  void look(double tail_m, double deepest_m, double soft_width_m) noexcept;
  double select(double tail_m, double soft_width_m) noexcept;
  void divide(std::uint32_t parts) noexcept;
  void pad() noexcept;
  Penetration sum_up(const Query&) noexcept;

  const simd::Kernels& kernels_;
  std::unique_ptr<BackEnd> exact_;
  FacingPatch s_, t_;
  LanePatch s_lanes_, t_lanes_;
  std::array<Cells, 2> memory_;
  simd::LaneCells cells_ = memory_[0].lanes(), next_ = memory_[1].lanes();
  std::size_t count_ = 0;
  std::vector<std::int32_t> bins_ = std::vector<std::int32_t>(kMostFirstCells + simd::kMostLanes);  // of the cells
  std::vector<std::uint32_t> kept_;  // cells that can still matter
  glm::dvec2 step_{0};
  bool has_parents_ = false;
  double best_m_ = 0;
  std::array<Memory, kMemories> memories_;
  std::array<double, kBins> fall_;  // what a cell weighs in each layer below the best
};

/// Cells that, halved some times, come out just fine enough for a peak like the last one.
double Simd::first_cell_m(const Window& window, std::uint32_t samples, double usual_step_m) const noexcept {
  const double n = std::clamp(samples, kBlock, kMostAcross);
  const double longer = std::max(window.high.x - window.low.x, window.high.y - window.low.y);
  const double texel_m = std::min(s_lanes_.finest_texel_m(), t_lanes_.finest_texel_m());
  const double cell_m = std::max(longer / n, std::isinf(texel_m) ? 0 : kFirstTexels * texel_m);
  if (!(usual_step_m > 0 && usual_step_m < cell_m)) return cell_m;
  return usual_step_m * std::exp2(std::round(std::log2(kRecalledTexels / kFirstTexels * cell_m / usual_step_m)));
}

/// The first level: square cells over the window, in blocks. They stand over its edge where that can't matter, else
/// they are shrunk to fit.
void Simd::tile(const Window& window, double cell_m, bool may_overhang) noexcept {
  const glm::dvec2 size = window.high - window.low;
  const auto blocks = [&](double length) {
    return std::max(1u, static_cast<std::uint32_t>(std::ceil(length / (kBlock * cell_m) - 1e-6)));
  };
  std::uint32_t across = blocks(size.x), down = blocks(size.y);
  while (std::size_t{across} * down * kBlock * kBlock > kMostFirstCells) {
    across = (across + 1) / 2, down = (down + 1) / 2;
    may_overhang = false;
  }
  step_ = may_overhang ? glm::dvec2{cell_m} : size / glm::dvec2{kBlock * across, kBlock * down};
  const glm::dvec2 low = 0.5 * (window.low + window.high - step_ * glm::dvec2{kBlock * across, kBlock * down});
  const float step_u = narrow(step_.x), step_v = narrow(step_.y);
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  count_ = 0;
  // A few blocks from all over first: against the best of them most others need no close look.
  for (const bool is_early : {true, false}) {
    for (std::uint32_t j = 0; j < down; ++j) {
      for (std::uint32_t i = 0; i < across; ++i) {
        if (((i + 2 * j) % 5 == 0) != is_early) continue;
        const float u = narrow(low.x + step_.x * (i * kBlock + 0.5)), v = narrow(low.y + step_.y * (j * kBlock + 0.5));
        for (std::uint32_t k = 0; k < kBlock * kBlock; ++k) {
          cells_.u[count_ + k] = u + step_u * static_cast<float>(k % kBlock);
          cells_.v[count_ + k] = v + step_v * static_cast<float>(k / kBlock);
          cells_.s_z[count_ + k] = cells_.t_z[count_ + k] = kUnknown;
        }
        count_ += kBlock * kBlock;
      }
    }
  }
  has_parents_ = false;
}

/// A few samples where the peak was: against the best of them most of the window needs no close look.
void Simd::recall(const Window& window, const glm::dvec3& p_CQ) noexcept {
  for (count_ = 0; count_ < kBlock * kBlock; ++count_) {
    const glm::dvec2 aside{static_cast<double>(count_ % kBlock) - 1.5, static_cast<double>(count_ / kBlock) - 1.5};
    const glm::dvec2 uv = glm::clamp(glm::dvec2{p_CQ} + step_ * aside, window.low, window.high);
    cells_.u[count_] = narrow(uv.x);
    cells_.v[count_] = narrow(uv.y);
    cells_.s_z[count_] = cells_.t_z[count_] = std::numeric_limits<float>::quiet_NaN();
  }
  has_parents_ = false;
}

void Simd::pad() noexcept {
  for (std::size_t k = count_; k % simd::kMostLanes != 0; ++k) {
    cells_.u[k] = cells_.u[count_ - 1], cells_.v[k] = cells_.v[count_ - 1];
    cells_.s_z[k] = cells_.s_z[count_ - 1], cells_.t_z[k] = cells_.t_z[count_ - 1];
  }
}

void Simd::look(double tail_m, double deepest_m, double soft_width_m) noexcept {
  const double reach_m = 0.5 * glm::length(step_);
  s_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  t_lanes_.suit(reach_m, has_parents_, 0.5 * soft_width_m);
  pad();
  const simd::CellTask task{.s = s_lanes_.side(),
                            .t = t_lanes_.side(),
                            .count = static_cast<std::int32_t>(count_),
                            .half_u = narrow(0.5 * step_.x),
                            .half_v = narrow(0.5 * step_.y),
                            .reach = narrow(reach_m),
                            .deepest = narrow(std::min(deepest_m, 1e6)),
                            .width = narrow(soft_width_m),
                            .fade = narrow(kEdgeFade_m),
                            .best = narrow(best_m_),
                            .tail = narrow(tail_m)};
  best_m_ = static_cast<double>(kernels_.look_at(task, cells_));
}

/// Cells that can still matter, and from them how wide the peak is: its curvature as it weighs in the integral, or,
/// where an edge of a patch cuts the peak off, the slope there. (Over a whole peak the mean square of the slope is w
/// times its curvatures' sum, so the two agree where there is no edge.)
double Simd::select(double tail_m, double soft_width_m) noexcept {
  const double lowest_m = std::max(best_m_ - tail_m, 0.99 * static_cast<double>(simd::kNowhere));
  const simd::WeightTask task{
      .count = static_cast<std::int32_t>((count_ + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes),
      .best = narrow(best_m_),
      .width = narrow(soft_width_m),
      .lowest = narrow(lowest_m),
      .near = narrow(best_m_ - kNearWidths * soft_width_m),
      .faded = narrow(kFadedWidths * soft_width_m),
      .bins_per_m = narrow(kBinsAWidth / soft_width_m),
      .bins = kBins};
  for (std::size_t k = count_; k % simd::kMostLanes != 0; ++k) cells_.bound[k] = simd::kNowhere;
  simd::Weights weights{};
  kernels_.weigh(task, cells_, bins_.data(), weights);
  std::array<std::uint32_t, kBins + 1> cells_in{};  // the first: of no interest
  for (std::size_t k = 0; k < count_; ++k) ++cells_in[static_cast<std::size_t>(bins_[k] + 1)];
  // Layers are left out from below while all their cells together, at their bounds, weigh next to nothing.
  std::int32_t layers = kBins;
  for (double left_out = 0; layers > 1; --layers) {
    const auto layer = static_cast<std::size_t>(layers);
    left_out += cells_in[layer] * fall_[layer - 1];
    if (left_out > kLeftOut * weights.known) break;
  }
  kept_.resize(count_);  // within its capacity
  std::size_t kept = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    kept_[kept] = static_cast<std::uint32_t>(k);
    kept += bins_[k] >= 0 && bins_[k] < layers ? 1 : 0;
  }
  kept_.resize(kept);
  if (weights.near < kLeastSeen) return 0;  // the best was recalled, and no cell's centre comes near it yet
  const double sharp_1_per_m = std::sqrt(weights.square_of_sharpness / weights.near);
  const double width_m = std::sqrt(soft_width_m / std::max(sharp_1_per_m, 1e-9));
  return weights.at_edge > kEdgeShare * weights.near ? std::min(width_m, kEdgeFade_m / kFadeWidths) : width_m;
}

void Simd::divide(std::uint32_t parts) noexcept {
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

Penetration Simd::sum_up(const Query& query) noexcept {
  for (std::size_t k = count_; k % simd::kMostLanes != 0; ++k) cells_.overlap[k] = simd::kNowhere;
  const double w = query.soft_width_m;
  const simd::SumTask task{
      .s = s_lanes_.side(),
      .t = t_lanes_.side(),
      .count = static_cast<std::int32_t>((count_ + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes),
      .area = narrow(step_.x * step_.y),
      .low = {narrow(query.window.low.x + step_.x), narrow(query.window.low.y + step_.y)},
      .high = {narrow(query.window.high.x - step_.x), narrow(query.window.high.y - step_.y)},
      .width = narrow(w),
      .level = narrow(best_m_),
      .fade = narrow(kEdgeFade_m),
      .To = {narrow(query.t.X_CO.p.x), narrow(query.t.X_CO.p.y), narrow(query.t.X_CO.p.z)},
      .wants_hessian = query.wants_hessian};
  simd::Sums sums{};
  kernels_.add_up(task, cells_, sums);
  if (!(sums.weight > 0)) return {};

  Penetration answer;
  answer.depth_m = static_cast<double>(task.level) + w * std::log(sums.weight / kReferenceArea_m2);
  answer.p_CQ_C = glm::dvec3{sums.point[0], sums.point[1], sums.point[2]} / sums.weight;
  for (int k = 0; k < 5; ++k) answer.gradient[k] = sums.gradient[k] / sums.weight;
  answer.gradient[5] = -1;
  if (query.wants_hessian) {
    for (int i = 0, k = 0; i < 5; ++i) {
      for (int j = 0; j <= i; ++j, ++k) {
        const double spread = sums.square[k] / sums.weight - answer.gradient[i] * answer.gradient[j];
        answer.hessian(i, j) = answer.hessian(j, i) = spread / w + sums.curvature[k] / sums.weight;
      }
    }
  }
  const bool is_silhouette = sums.edge > 0.5 * sums.weight;
  answer.doubts = 0;
  if (is_silhouette) answer.doubts |= kSilhouette;
  if (!is_silhouette && sums.border > 0.01 * sums.weight) answer.doubts |= kBorder;
  if (sums.steep > 0.01 * sums.weight) answer.doubts |= kGrazing;
  const glm::dvec2 Q{answer.p_CQ_C};
  if (s_.has_several_layers_at(Q) || t_.has_several_layers_at(Q)) answer.doubts |= kSeveralLayers;
  return answer;
}

Penetration Simd::answer(const Query& query, Memory& memory) noexcept {
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return {};
  s_lanes_.copy(s_, *query.s.surface);
  t_lanes_.copy(t_, *query.t.surface);
  const Window &s_box = s_lanes_.box(), &t_box = t_lanes_.box();
  const Window shared{glm::max(query.window.low, glm::max(s_box.low, t_box.low)),
                      glm::min(query.window.high, glm::min(s_box.high, t_box.high))};
  if (!(shared.low.x < shared.high.x && shared.low.y < shared.high.y)) return {};

  const double w = query.soft_width_m, tail_m = w * (query.wants_hessian ? kTailWidthsOfHessian : kTailWidths);
  const double texel_m = std::min(s_lanes_.finest_texel_m(), t_lanes_.finest_texel_m());
  best_m_ = static_cast<double>(simd::kNowhere);
  const bool is_known_pair = memory.s == query.s.surface && memory.t == query.t.surface;
  if (is_known_pair) {
    step_ = glm::dvec2{memory.target_m};
    recall(shared, spatial::transform_point(query.t.X_CO, memory.p_TQ));
    look(tail_m, query.deepest_m, w);
  }
  const bool is_limited = shared.low.x <= query.window.low.x || shared.low.y <= query.window.low.y ||
                          shared.high.x >= query.window.high.x || shared.high.y >= query.window.high.y;
  tile(shared, first_cell_m(shared, query.samples, is_known_pair ? memory.target_m : 0), !is_limited);
  bool is_coarse = false;
  double target_m = 0;
  while (true) {
    look(tail_m, query.deepest_m, w);
    const double width_m = select(tail_m, w);
    if (kept_.empty()) return {};
    const double longer = std::max(step_.x, step_.y);
    const bool is_apart = best_m_ < -kApart_m;
    const double widths = is_apart ? kApartStepWidths : query.wants_hessian ? kStepWidthsOfHessian : kStepWidths;
    target_m = std::min(width_m * widths, (query.wants_hessian ? 1 : kMostTexels) * texel_m);
    if (longer <= target_m && kept_.size() >= kLeastCells) break;
    constexpr std::uint32_t parts = 2;
    const std::size_t most_cells = is_apart ? kMostCellsApart : query.wants_hessian ? kMostFirstCells : kMostCells;
    is_coarse = longer < kLeastStep_m || parts * parts * kept_.size() > most_cells;
    if (is_coarse) break;
    divide(parts);
  }
  Penetration answer = sum_up(query);
  if (answer.is_known() && is_coarse) answer.doubts |= kCoarseSteps;
  memory = {.s = query.s.surface,
            .t = query.t.surface,
            .p_TQ = spatial::transform_point(spatial::inverse(query.t.X_CO), answer.p_CQ_C),
            .target_m = std::max(kUsualShare * target_m, kLeastStep_m)};
  return answer;
}

}  // namespace

std::unique_ptr<BackEnd> make_simd(const Limits& limits, InstructionSet set) {
  return std::make_unique<Simd>(limits, kernels_of(set));
}

std::string_view instruction_set_name(InstructionSet set) {
  return kernels_of(set).name;
}

}  // namespace farfeel::penetration
