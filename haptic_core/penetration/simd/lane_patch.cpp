#include "haptic_core/penetration/simd/lane_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/penetration/simd/narrow.h"

namespace farfeel::penetration {
namespace {

constexpr double kLeastCosine = 1e-8;
constexpr double kMostSlope = 6;           ///< of what leans over: as steep as 80 degrees
constexpr double kLeastSquare_m2 = 1e-14;  ///< edges shorter than this in C's plane stand upright

/// Along C's plane, of a texture up to `slope` steep on a chart whose axis has that cosine and sine to C's z.
double slope_along(double slope, double cosine, double sine) {
  const double least = cosine - slope * sine;  // the tangent of a sum of angles
  return least > 0 ? std::min((sine + slope * cosine) / least, kMostSlope) : kMostSlope;
}

simd::LaneFacet lane_facet(const Facet& facet) {
  simd::LaneFacet lane{};
  for (int k = 0; k < 3; ++k) {
    lane.plane[k] = narrow(facet.plane[k]);
    for (int i = 0; i < 3; ++i) lane.inside[k][i] = narrow(facet.inside[k][i]);
  }
  return lane;
}

simd::LaneChart lane_chart(const Facet& facet, const FeltSurface& felt) {
  simd::LaneChart lane{};
  for (int i = 0; i < 3; ++i) lane.plane[i] = narrow(facet.plane[i]);
  lane.reach_up = narrow(facet.reach_up_m);
  lane.reach_down = narrow(facet.reach_down_m);
  lane.most_drift = narrow(facet.most_drift_m);
  lane.most_slope = lane.plane_slope = narrow(std::hypot(facet.plane.y, facet.plane.z));
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
      // What rounding leaves of a zero would make products too small for normal floats, which are slow.
      lane.axes[c][k] = std::abs(facet.R_HC[c][k]) < kLeastCosine ? 0.0f : narrow(facet.R_HC[c][k]);
    }
  }
  const double lift = 1 / facet.R_HC[2].z;
  lane.plane[0] = narrow(-facet.p_HC_H.z * lift);
  lane.plane[1] = narrow(-facet.R_HC[0].z * lift);
  lane.plane[2] = narrow(-facet.R_HC[1].z * lift);
  lane.lift = narrow(lift);
  lane.plane_slope = std::hypot(lane.plane[1], lane.plane[2]);
  lane.tilt = narrow(std::hypot(facet.R_HC[2].x, facet.R_HC[2].y));
  lane.toward = facet.R_HC[2].z < 0 ? -1.0f : 1.0f;
  lane.most_bend = narrow(felt.most_bend_1_per_m(facet.chart_index));
  lane.most_slope = narrow(slope_along(felt.most_slope(facet.chart_index), std::abs(facet.R_HC[2].z),
                                       std::hypot(facet.R_HC[2].x, facet.R_HC[2].y)));
  lane.bend_scale = narrow(kBendUnit * felt.haptic().scale.scale_m * texels_per_m * texels_per_m);
  return lane;
}

simd::LaneEdge lane_edge(const PatchEdge& edge) {
  simd::LaneEdge lane{};
  const glm::dvec3 along = edge.b_C - edge.a_C;
  const double square = along.x * along.x + along.y * along.y;
  for (int k = 0; k < 3; ++k) lane.a[k] = narrow(edge.a_C[k]), lane.along[k] = narrow(along[k]);
  lane.per_square = square > kLeastSquare_m2 ? narrow(1 / square) : 0.0f;
  return lane;
}

}  // namespace

void LanePatch::Boxes::reserve(std::size_t count) {
  for (auto* column : {&low_u, &high_u, &low_v, &high_v}) column->reserve(count + simd::kMostLanes);
}

void LanePatch::Boxes::resize(std::size_t count) noexcept {
  constexpr double kFar_m = 1e9;
  const std::size_t padded = (count + simd::kMostLanes - 1) / simd::kMostLanes * simd::kMostLanes;
  for (auto* column : {&low_u, &high_u, &low_v, &high_v}) column->resize(padded);  // within its capacity
  for (std::size_t i = count; i < padded; ++i) set(i, glm::dvec2{kFar_m}, glm::dvec2{-kFar_m});
}

void LanePatch::Boxes::set(std::size_t i, const glm::dvec2& low, const glm::dvec2& high) noexcept {
  low_u[i] = narrow(low.x), high_u[i] = narrow(high.x);
  low_v[i] = narrow(low.y), high_v[i] = narrow(high.y);
}

simd::LaneBoxes LanePatch::Boxes::lanes() const noexcept {
  return {.low_u = low_u.data(),
          .high_u = high_u.data(),
          .low_v = low_v.data(),
          .high_v = high_v.data(),
          .count = static_cast<std::int32_t>(low_u.size())};
}

LanePatch::LanePatch(const Limits& limits, Side which) : which_(which) {
  facets_.reserve(limits.coarse_triangles);
  charts_.reserve(limits.coarse_triangles);
  chart_indices_.reserve(limits.coarse_triangles);
  facet_boxes_.reserve(limits.coarse_triangles);
  for (auto& column : facet_edges_) column.reserve(limits.coarse_triangles + simd::kMostLanes);
  edges_.reserve(3 * limits.coarse_triangles);
  edge_boxes_.reserve(3 * limits.coarse_triangles);
}

void LanePatch::copy(const FacingPatch& patch, const FeltSurface& felt) noexcept {
  felt_ = &felt;
  const std::span<const Facet> facets = patch.facets();
  const std::span<const PatchEdge> edges = patch.edges();
  facets_.clear(), charts_.clear(), chart_indices_.clear(), edges_.clear();
  facet_boxes_.resize(facets.size()), edge_boxes_.resize(edges.size());
  for (auto& column : facet_edges_) column.resize(facet_boxes_.low_u.size());
  box_ = {glm::dvec2{std::numeric_limits<double>::infinity()}, glm::dvec2{-std::numeric_limits<double>::infinity()}};
  finest_texel_m_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < facets.size(); ++i) {
    const Facet& facet = facets[i];
    facets_.push_back(lane_facet(facet));
    facets_.back().chart = chart_of(facet);
    facet_boxes_.set(i, facet.low, facet.high);
    for (std::size_t k = 0; k < 9; ++k) facet_edges_[k][i] = facets_.back().inside[k / 3][k % 3];
    box_ = {glm::min(box_.low, facet.low), glm::max(box_.high, facet.high)};
    if (facet.chart) finest_texel_m_ = std::min(finest_texel_m_, facet.chart->texel_m);
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    edges_.push_back(lane_edge(edges[i]));
    edge_boxes_.set(i, edges[i].low, edges[i].high);
  }
}

/// Facets of one chart are looked at together, so they share what any of them may need.
std::int32_t LanePatch::chart_of(const Facet& facet) noexcept {
  const auto known =
      facet.chart ? std::find(chart_indices_.begin(), chart_indices_.end(), facet.chart_index) : chart_indices_.end();
  const auto at = known - chart_indices_.begin();
  if (known == chart_indices_.end()) {
    charts_.push_back(lane_chart(facet, *felt_));
    chart_indices_.push_back(facet.chart_index);
  } else {
    simd::LaneChart& chart = charts_[static_cast<std::size_t>(at)];
    chart.reach_up = std::max(chart.reach_up, narrow(facet.reach_up_m));
    chart.reach_down = std::min(chart.reach_down, narrow(facet.reach_down_m));
    chart.most_drift = std::max(chart.most_drift, narrow(facet.most_drift_m));
  }
  return static_cast<std::int32_t>(at);
}

void LanePatch::suit(double reach_m, bool has_guess, double small_m) noexcept {
  for (std::size_t i = 0; i < charts_.size(); ++i) {
    simd::LaneChart& chart = charts_[i];
    if (!chart.heights) continue;
    chart.bounds = nullptr;
    if (0.5 * reach_m * reach_m * static_cast<double>(chart.most_bend) < small_m) continue;
    // Where the ray meets the chart is as uncertain as the height along it, times the lean.
    const double up_m = chart.reach_up, down_m = chart.reach_down;
    const double known_m = chart.tilt > simd::kAskew ? std::max(std::abs(up_m), std::abs(down_m))
                           : has_guess               ? reach_m
                                                     : 0.5 * (up_m - down_m);
    const double texels =
        static_cast<double>(chart.texels_per_m) * (reach_m + static_cast<double>(chart.tilt) * known_m);
    std::uint32_t level = 0;
    while (level + 1 < kBoundsLevels && static_cast<double>(1u << level) < texels) ++level;
    const BoundsLevel bounds = felt_->bounds(chart_indices_[i]).level(level);
    chart.bounds = bounds.entries;
    chart.bounds_columns = static_cast<std::int32_t>(bounds.columns);
    chart.bounds_rows = static_cast<std::int32_t>(bounds.rows);
    chart.bounds_per_texel = 1 / static_cast<float>(1u << level);
    chart.spare = std::max((static_cast<float>(1u << level) - narrow(texels)) / chart.texels_per_m, 0.0f);
  }
}

simd::LaneSide LanePatch::side() const noexcept {
  const auto& c = facet_edges_;
  return {.facets = facets_.data(),
          .charts = charts_.data(),
          .edges = edges_.data(),
          .facet_edges = {{c[0].data(), c[1].data(), c[2].data()},
                          {c[3].data(), c[4].data(), c[5].data()},
                          {c[6].data(), c[7].data(), c[8].data()}},
          .facet_boxes = facet_boxes_.lanes(),
          .edge_boxes = edge_boxes_.lanes(),
          .outward = which_ == Side::kOutermost ? 1.0f : -1.0f};
}

}  // namespace farfeel::penetration
