// As in reference.cpp: a grid finds the cells that matter and is laid again over them alone; the best cells are looked
// at more and more closely until the peak's width is known; cells that can matter are quartered until they resolve it,
// and summed.
// Nodes stand in blocks of 4 x 4, so that a vector of them covers a compact place and few triangles.
#include "haptic_core/penetration/simd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "haptic_core/penetration/facing_patch.h"
#include "haptic_core/penetration/reference.h"
#include "haptic_core/penetration/simd_kernels.h"

namespace farfeel::penetration {
namespace {

constexpr std::uint32_t kBlock = 4;  ///< nodes along a side of a block
constexpr std::size_t kBlockNodes = kBlock * kBlock;
static_assert(kBlockNodes == simd::kMostLanes);
constexpr std::size_t kMostNodes = 16'000, kMostNodesApart = 600;  ///< of one level of the quadrature
constexpr double kApart_m = 0.3e-3;   ///< surfaces farther apart are felt by nobody yet: fewer cells will do
constexpr double kTailWidths = 10;    ///< cells further below the peak weigh under 1e-4 and are left out
constexpr double kHiddenSlope = 0.4;  ///< of texture between the first scan's nodes: how high it may rise unseen
constexpr int kMostZooms = 1;
constexpr std::size_t kPeaks = 4;             ///< best cells looked at closely
constexpr int kLooks = 3;                     ///< each look narrows a cell to a quarter
constexpr int kFindSteps = 1, kSumSteps = 2;  ///< of Newton, for finding cells and for summing
constexpr float kNoMargin = 1e30f;
constexpr float kSteepestReach = 3;  ///< slope between two surfaces that a cell's bound may assume
constexpr float kOutside = 1e9f;     ///< [m] where nodes that fill up a block stand

/// Whoever asks which kernels a machine can run.
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

struct Grid {
  glm::dvec2 low, step;
  std::uint32_t n;  // cells along a side

  [[nodiscard]] std::uint32_t blocks() const { return (n + kBlock - 1) / kBlock; }
  [[nodiscard]] std::size_t nodes() const { return std::size_t{blocks()} * blocks() * kBlockNodes; }
  [[nodiscard]] std::size_t index(std::uint32_t i, std::uint32_t j) const {
    return (std::size_t{j / kBlock} * blocks() + i / kBlock) * kBlockNodes + (j % kBlock) * kBlock + i % kBlock;
  }
  [[nodiscard]] glm::dvec2 centre(std::uint32_t i, std::uint32_t j) const {
    return low + step * glm::dvec2{i + 0.5, j + 0.5};
  }
};

/// What the closest look at the best cell found.
struct Peak {
  double overlap_m = simd::kNowhere;
  double width_m = 1;
};

class Simd final : public BackEnd {
 public:
  Simd(const Limits& limits, const simd::Kernels& kernels)
      : kernels_(kernels), exact_(make_reference(limits)), s_(limits), t_(limits) {
    const std::size_t nodes = std::size_t{kMaxSamples + kBlock} * (kMaxSamples + kBlock);
    for (auto* column : {&u_, &v_, &area_, &overlap_, &s_u_, &s_v_, &t_z_, &t_u_, &t_v_, &bound_, &next_u_, &next_v_}) {
      column->resize(nodes);
    }
    for (auto* facets : {&s_facets_, &t_facets_}) facets->reserve(limits.coarse_triangles);
    for (auto* edges : {&s_edges_, &t_edges_}) edges->reserve(3 * limits.coarse_triangles);
  }

  void evaluate(std::span<const Query> queries, std::span<Penetration> answers) noexcept override {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const Query& query = queries[i];
      if (query.soft_width_m > 0 && !query.wants_hessian) {
        answers[i] = answer(query);
      } else {
        exact_->evaluate(queries.subspan(i, 1), answers.subspan(i, 1));
      }
    }
  }

 private:
  Penetration answer(const Query& query) noexcept;
  void overlaps(std::size_t count, int steps, double margin_m) noexcept;
  double scan(const Grid& grid, double tail_m) noexcept;
  Window active_part(const Grid& grid, double threshold_m) const noexcept;
  Peak look_closely(const Grid& grid, double soft_width_m) noexcept;
  /// The cells kept so far: centres in next_u_, next_v_. split() puts their quarters into u_, v_, by fours;
  /// keep_active() keeps those of them that may come within tail_m of the best.
  void keep(float u, float v) noexcept;
  void split(const glm::dvec2& quarter) noexcept;
  void keep_active(double reach_m, double tail_m, double& best_m) noexcept;
  Penetration sum_up(const Query& query, const Grid& grid, const Peak& peak) noexcept;

  const simd::Kernels& kernels_;
  std::unique_ptr<BackEnd> exact_;
  FacingPatch s_, t_;
  std::vector<simd::LaneFacet> s_facets_, t_facets_;
  std::vector<simd::LaneEdge> s_edges_, t_edges_;
  std::vector<float> u_, v_, area_, overlap_, s_u_, s_v_, t_z_, t_u_, t_v_;
  std::vector<float> bound_;  // what a grid cell may reach, by its index in the grid
  std::vector<float> next_u_, next_v_;
  std::size_t kept_ = 0;
  double deepest_m_ = 0;
};

float narrow(double x) {
  return static_cast<float>(x);
}

simd::LaneFacet lane_facet(const Facet& facet, const FeltSurface& felt) {
  simd::LaneFacet lane{};
  for (int k = 0; k < 2; ++k) lane.low[k] = narrow(facet.low[k]), lane.high[k] = narrow(facet.high[k]);
  for (int k = 0; k < 3; ++k) {
    lane.plane[k] = narrow(facet.plane[k]);
    for (int i = 0; i < 3; ++i) lane.inside[k][i] = narrow(facet.inside[k][i]);
  }
  lane.reach_up = narrow(facet.reach_up_m);
  lane.reach_down = narrow(facet.reach_down_m);
  lane.most_drift = narrow(facet.most_drift_m);
  if (!facet.chart) return lane;
  const PackedHeights packed = felt.packed(facet.chart_index);
  lane.heights = packed.heights;
  lane.stride = static_cast<std::int32_t>(packed.stride);
  lane.columns = static_cast<std::int32_t>(facet.chart->columns);
  lane.rows = static_cast<std::int32_t>(facet.chart->rows);
  lane.offset = narrow(felt.haptic().scale.offset_m);
  lane.scale = narrow(felt.haptic().scale.scale_m);
  const double texels_per_m = 1 / facet.chart->texel_m;
  lane.texels_per_m = narrow(texels_per_m);
  for (int k = 0; k < 3; ++k) {
    const double unit = k < 2 ? texels_per_m : 1;
    lane.to_H[k][0] = narrow(unit * facet.p_HC_H[k]);
    for (int c = 0; c < 3; ++c) {
      lane.to_H[k][c + 1] = narrow(unit * facet.R_HC[c][k]);
      lane.axes[c][k] = narrow(facet.R_HC[c][k]);
    }
  }
  lane.tilt = narrow(std::hypot(facet.R_HC[2].x, facet.R_HC[2].y));
  lane.toward = facet.R_HC[2].z < 0 ? -1.0f : 1.0f;
  return lane;
}

/// The greatest height of texture over any facet of the patch, along C's z.
double relief_of(const FacingPatch& patch) {
  double most_m = 0;
  for (const Facet& facet : patch.facets()) most_m = std::max(most_m, facet.reach_up_m - facet.reach_down_m);
  return most_m;
}

simd::LaneEdge lane_edge(const PatchEdge& edge) {
  simd::LaneEdge lane{};
  const glm::dvec3 along = edge.b_C - edge.a_C;
  const double square = along.x * along.x + along.y * along.y;
  for (int k = 0; k < 3; ++k) lane.a[k] = narrow(edge.a_C[k]), lane.along[k] = narrow(along[k]);
  lane.per_square = square > 1e-14 ? narrow(1 / square) : 0.0f;
  for (int k = 0; k < 2; ++k) lane.low[k] = narrow(edge.low[k]), lane.high[k] = narrow(edge.high[k]);
  return lane;
}

void Simd::overlaps(std::size_t count, int steps, double margin_m) noexcept {
  const simd::OverlapTask task{.s = s_facets_.data(),
                               .t = t_facets_.data(),
                               .s_count = static_cast<std::int32_t>(s_facets_.size()),
                               .t_count = static_cast<std::int32_t>(t_facets_.size()),
                               .u = u_.data(),
                               .v = v_.data(),
                               .count = static_cast<std::int32_t>(count),
                               .steps = steps,
                               .deepest = narrow(std::min(deepest_m_, 1e6)),
                               .margin = narrow(margin_m)};
  kernels_.overlaps_at(task, {overlap_.data(), s_u_.data(), s_v_.data(), t_z_.data(), t_u_.data(), t_v_.data()});
}

double Simd::scan(const Grid& grid, double tail_m) noexcept {
  const std::uint32_t padded = grid.blocks() * kBlock;
  for (std::uint32_t j = 0; j < padded; ++j) {
    for (std::uint32_t i = 0; i < padded; ++i) {
      const std::size_t k = grid.index(i, j);
      const glm::dvec2 uv = grid.centre(i, j);
      u_[k] = i < grid.n && j < grid.n ? narrow(uv.x) : kOutside;
      v_[k] = narrow(uv.y);
    }
  }
  const double reach = 0.5 * glm::length(grid.step);
  overlaps(grid.nodes(), kFindSteps, tail_m + 2 * reach);
  float best = simd::kNowhere;
  for (std::size_t k = 0; k < grid.nodes(); ++k) best = std::max(best, overlap_[k]);

  // Between nodes the overlap may rise by its slope, and by as much more as slopes differ from neighbour to neighbour.
  const auto reach_f = narrow(reach);
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    const std::uint32_t below = j - (j > 0), above = std::min(j + 1, grid.n - 1);
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      const std::size_t k = grid.index(i, j);
      const std::array<std::size_t, 4> beside{grid.index(i - (i > 0), j), grid.index(std::min(i + 1, grid.n - 1), j),
                                              grid.index(i, below), grid.index(i, above)};
      bound_[k] = simd::kNowhere;
      if (overlap_[k] == simd::kNowhere) {
        // The centre lies outside a patch, whose edge may still cross the cell: the neighbours say how high.
        for (const std::size_t m : beside) {
          if (overlap_[m] == simd::kNowhere) continue;
          const float slope = std::abs(s_u_[m] - t_u_[m]) + std::abs(s_v_[m] - t_v_[m]);
          bound_[k] = std::max(bound_[k], overlap_[m] + 3 * reach_f * slope);
        }
        continue;
      }
      // What lies too far below the best to reach it by any slope a height field has needs no closer look.
      if (overlap_[k] < best - narrow(tail_m) - kSteepestReach * reach_f) continue;
      const float d_u = s_u_[k] - t_u_[k], d_v = s_v_[k] - t_v_[k];
      float turn = 0;
      for (const std::size_t m : beside) {
        if (overlap_[m] == simd::kNowhere) continue;
        turn = std::max(turn, std::abs(s_u_[m] - t_u_[m] - d_u) + std::abs(s_v_[m] - t_v_[m] - d_v));
      }
      bound_[k] = overlap_[k] + reach_f * (std::sqrt(d_u * d_u + d_v * d_v) + 0.5f * turn);
    }
  }
  return best;
}

Window Simd::active_part(const Grid& grid, double threshold_m) const noexcept {
  std::uint32_t low_i = grid.n, low_j = grid.n, high_i = 0, high_j = 0;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      if (bound_[grid.index(i, j)] < threshold_m) continue;
      low_i = std::min(low_i, i), high_i = std::max(high_i, i + 1);
      low_j = std::min(low_j, j), high_j = std::max(high_j, j + 1);
    }
  }
  const glm::dvec2 low{low_i - std::min(low_i, 1u), low_j - std::min(low_j, 1u)};
  const glm::dvec2 high{std::min(high_i + 1, grid.n), std::min(high_j + 1, grid.n)};
  return {grid.low + low * grid.step, grid.low + high * grid.step};
}

Peak Simd::look_closely(const Grid& grid, double soft_width_m) noexcept {
  struct Place {
    float bound = simd::kNowhere;
    glm::dvec2 centre{0};
  };
  std::array<Place, kPeaks> places;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      const float bound = bound_[grid.index(i, j)];
      if (bound <= places.back().bound) continue;
      std::size_t at = kPeaks - 1;
      for (; at > 0 && places[at - 1].bound < bound; --at) places[at] = places[at - 1];
      places[at] = {bound, grid.centre(i, j)};
    }
  }
  Peak peak;
  glm::dvec2 step = grid.step * 0.5;
  for (int look = 0; look < kLooks; ++look, step *= 0.25) {
    for (std::size_t p = 0; p < kPeaks; ++p) {
      for (std::size_t k = 0; k < kBlockNodes; ++k) {
        const glm::dvec2 uv = places[p].centre + step * glm::dvec2{static_cast<double>(k % kBlock) - 1.5,
                                                                   static_cast<double>(k / kBlock) - 1.5};
        u_[p * kBlockNodes + k] = places[p].bound == simd::kNowhere ? kOutside : narrow(uv.x);
        v_[p * kBlockNodes + k] = narrow(uv.y);
      }
    }
    overlaps(kPeaks * kBlockNodes, kFindSteps, kNoMargin);
    for (std::size_t p = 0; p < kPeaks; ++p) {
      const std::size_t first = p * kBlockNodes;
      const auto best = static_cast<std::size_t>(
          std::max_element(overlap_.begin() + first, overlap_.begin() + first + kBlockNodes) - overlap_.begin());
      if (overlap_[best] == simd::kNowhere) continue;
      places[p].centre = {u_[best], v_[best]};
      if (overlap_[best] <= peak.overlap_m) continue;
      // Curvature by how slopes turn from the best node to its neighbours in the block; slope where an edge holds it.
      peak.overlap_m = overlap_[best];
      const double d_u = s_u_[best] - t_u_[best], d_v = s_v_[best] - t_v_[best];
      double bend = 1e-6;
      for (std::size_t k = first; k < first + kBlockNodes; ++k) {
        const double du = u_[k] - u_[best], dv = v_[k] - v_[best], apart = du * du + dv * dv;
        if (overlap_[k] == simd::kNowhere || !(apart > 0) || apart > 2.1 * glm::dot(step, step)) continue;
        bend = std::max(bend, -((s_u_[k] - t_u_[k] - d_u) * du + (s_v_[k] - t_v_[k] - d_v) * dv) / apart);
      }
      const double slope_left = std::max(0.0, std::hypot(d_u, d_v) - bend * glm::length(step));
      peak.width_m = std::min(std::sqrt(soft_width_m / bend), soft_width_m / std::max(slope_left, 1e-9));
    }
  }
  return peak;
}

void Simd::keep(float u, float v) noexcept {
  next_u_[kept_] = u;
  next_v_[kept_] = v;
  ++kept_;
}

void Simd::split(const glm::dvec2& quarter) noexcept {
  const std::array<glm::dvec2, 4> corners{glm::dvec2{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
  std::size_t count = 0;
  for (std::size_t k = 0; k < kept_; ++k) {
    for (const glm::dvec2& corner : corners) {
      u_[count] = next_u_[k] + narrow(corner.x * quarter.x);
      v_[count] = next_v_[k] + narrow(corner.y * quarter.y);
      ++count;
    }
  }
  kept_ = count;
  for (; count % simd::kMostLanes != 0; ++count) u_[count] = kOutside, v_[count] = 0, area_[count] = 0;
}

void Simd::keep_active(double reach_m, double tail_m, double& best_m) noexcept {
  const std::size_t count = kept_;
  for (std::size_t k = 0; k < count; ++k) best_m = std::max<double>(best_m, overlap_[k]);
  const auto reach = narrow(reach_m), threshold = narrow(best_m - tail_m);
  kept_ = 0;
  for (std::size_t first = 0; first < count; first += 4) {
    // Siblings lend each other their turn of slope, and what lies outside a patch the bound of those inside.
    float low_u = 1e9f, high_u = -1e9f, low_v = 1e9f, high_v = -1e9f, highest = simd::kNowhere;
    for (std::size_t k = first; k < first + 4; ++k) {
      if (overlap_[k] == simd::kNowhere) continue;
      const float d_u = s_u_[k] - t_u_[k], d_v = s_v_[k] - t_v_[k];
      low_u = std::min(low_u, d_u), high_u = std::max(high_u, d_u);
      low_v = std::min(low_v, d_v), high_v = std::max(high_v, d_v);
    }
    const float turn = high_u < low_u ? 0 : high_u - low_u + high_v - low_v;
    std::array<float, 4> bound;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t at = first + k;
      bound[k] = simd::kNowhere;
      if (overlap_[at] == simd::kNowhere) continue;
      const float d_u = s_u_[at] - t_u_[at], d_v = s_v_[at] - t_v_[at];
      bound[k] = overlap_[at] + reach * (std::sqrt(d_u * d_u + d_v * d_v) + 0.5f * turn);
      highest = std::max(highest, bound[k] + 2 * reach * std::sqrt(d_u * d_u + d_v * d_v));
    }
    for (std::size_t k = 0; k < 4; ++k) {
      if ((overlap_[first + k] == simd::kNowhere ? highest : bound[k]) >= threshold) keep(u_[first + k], v_[first + k]);
    }
  }
}

Penetration Simd::sum_up(const Query& query, const Grid& grid, const Peak& peak) noexcept {
  const double w = query.soft_width_m, tail_m = kTailWidths * w;
  const bool is_apart = peak.overlap_m < -kApart_m;
  const double target_m = is_apart ? 2 * peak.width_m : peak.width_m;
  const std::size_t most = is_apart ? kMostNodesApart : kMostNodes;
  double best_m = peak.overlap_m;
  kept_ = 0;
  for (std::uint32_t j = 0; j < grid.n; ++j) {
    for (std::uint32_t i = 0; i < grid.n; ++i) {
      if (bound_[grid.index(i, j)] < best_m - tail_m) continue;
      const glm::dvec2 centre = grid.centre(i, j);
      keep(narrow(centre.x), narrow(centre.y));
    }
  }
  // Quarter the cells that can still matter, until the step resolves the peak.
  glm::dvec2 step = grid.step;
  while (std::max(step.x, step.y) > target_m && 4 * kept_ <= most) {
    step *= 0.5;
    split(0.5 * step);
    overlaps((kept_ + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes, kFindSteps, kNoMargin);
    keep_active(0.5 * glm::length(step), tail_m, best_m);
  }

  const glm::dvec2 inner_low = grid.low + grid.step;
  const glm::dvec2 inner_high = grid.low + grid.step * static_cast<double>(grid.n - 1);
  const float area = narrow(step.x * step.y);
  std::size_t count = 0;
  for (; count < kept_; ++count) {
    const float u = next_u_[count], v = next_v_[count];
    const bool is_at_border = u < inner_low.x || u > inner_high.x || v < inner_low.y || v > inner_high.y;
    u_[count] = u;
    v_[count] = v;
    area_[count] = is_at_border ? -area : area;
  }
  for (; count % simd::kMostLanes != 0; ++count) u_[count] = kOutside, v_[count] = 0, area_[count] = 0;
  overlaps(count, kSumSteps, kNoMargin);
  const simd::SumTask task{.s = s_edges_.data(),
                           .t = t_edges_.data(),
                           .s_count = static_cast<std::int32_t>(s_edges_.size()),
                           .t_count = static_cast<std::int32_t>(t_edges_.size()),
                           .u = u_.data(),
                           .v = v_.data(),
                           .area = area_.data(),
                           .count = static_cast<std::int32_t>(count),
                           .width = narrow(w),
                           .level = narrow(best_m),
                           .fade = narrow(kEdgeFade_m),
                           .To = {narrow(query.t.X_CO.p.x), narrow(query.t.X_CO.p.y), narrow(query.t.X_CO.p.z)}};
  simd::Sums sums{};
  kernels_.add_up(task, {overlap_.data(), s_u_.data(), s_v_.data(), t_z_.data(), t_u_.data(), t_v_.data()}, sums);
  if (!(sums.weight > 0)) return {};

  Penetration answer;
  answer.depth_m = static_cast<double>(task.level) + w * std::log(sums.weight / kReferenceArea_m2);
  answer.p_CQ_C = glm::dvec3{sums.point[0], sums.point[1], sums.point[2]} / sums.weight;
  for (int k = 0; k < 5; ++k) answer.gradient[k] = sums.gradient[k] / sums.weight;
  answer.gradient[5] = -1;
  const bool is_silhouette = sums.edge > 0.5 * sums.weight;
  answer.doubts = 0;
  if (is_silhouette) answer.doubts |= kSilhouette;
  if (!is_silhouette && sums.border > 0.01 * sums.weight) answer.doubts |= kBorder;
  if (sums.steep > 0.01 * sums.weight) answer.doubts |= kGrazing;
  if (std::max(step.x, step.y) > target_m) answer.doubts |= kCoarseSteps;
  const glm::dvec2 Q{answer.p_CQ_C};
  if (s_.has_several_layers_at(Q) || t_.has_several_layers_at(Q)) answer.doubts |= kSeveralLayers;
  return answer;
}

Penetration Simd::answer(const Query& query) noexcept {
  deepest_m_ = query.deepest_m;
  s_.project(query.s, Side::kOutermost, query.window);
  t_.project(query.t, Side::kInnermost, query.window);
  if (s_.facets().empty() || t_.facets().empty()) return {};
  s_facets_.clear(), t_facets_.clear(), s_edges_.clear(), t_edges_.clear();
  for (const Facet& facet : s_.facets()) s_facets_.push_back(lane_facet(facet, *query.s.surface));
  for (const Facet& facet : t_.facets()) t_facets_.push_back(lane_facet(facet, *query.t.surface));
  for (const PatchEdge& edge : s_.edges()) s_edges_.push_back(lane_edge(edge));
  for (const PatchEdge& edge : t_.edges()) t_edges_.push_back(lane_edge(edge));

  // A quarter of the cells find the part of the window that matters; all of them are laid over that part.
  const std::uint32_t n = std::clamp(query.samples, 1u, kMaxSamples);
  Grid grid{.low = query.window.low, .step = {}, .n = std::max((n + 1) / 2, 1u)};
  grid.step = (query.window.high - query.window.low) / static_cast<double>(grid.n);
  const double tail_m = kTailWidths * query.soft_width_m;
  // Its cells may be wider than the texture's waves: peaks hide between nodes, up to half the relief.
  const double hidden_m = std::min(0.5 * (relief_of(s_) + relief_of(t_)), kHiddenSlope * 0.5 * glm::length(grid.step));
  double best = scan(grid, tail_m + hidden_m);
  for (int zoom = 0; zoom < kMostZooms && best != simd::kNowhere; ++zoom) {
    const bool is_apart = best < -kApart_m;
    const Window part = active_part(grid, best - tail_m - (zoom == 0 && !is_apart ? hidden_m : 0));
    const glm::dvec2 size = part.high - part.low, whole = grid.step * static_cast<double>(grid.n);
    if (zoom > 0 && size.x > 0.5 * whole.x && size.y > 0.5 * whole.y) break;
    const std::uint32_t cells = is_apart ? grid.n : n;
    grid = {.low = part.low, .step = size / static_cast<double>(cells), .n = cells};
    best = scan(grid, tail_m);
  }
  if (best == simd::kNowhere) return {};
  Peak peak = look_closely(grid, query.soft_width_m);
  peak.overlap_m = std::max(peak.overlap_m, best);
  return sum_up(query, grid, peak);
}

}  // namespace

std::unique_ptr<BackEnd> make_simd(const Limits& limits, InstructionSet set) {
  return std::make_unique<Simd>(limits, kernels_of(set));
}

std::string_view instruction_set_name(InstructionSet set) {
  return kernels_of(set).name;
}

}  // namespace farfeel::penetration
