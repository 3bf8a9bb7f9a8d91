// The displaced surface over a chart's plane H is F(p) = r - h(s, t) = 0 with p = (s, t, r) in H. Along the ray of
// fixed (u, v) it is found by Newton in z. Its derivatives in C follow from the implicit function theorem: with G =
// grad F and Q = the second derivative of F, both turned into C,
//   z_u = -G_u / G_z,   z_uv = -(Q_uv + Q_uz z_v + Q_vz z_u + Q_zz z_u z_v) / G_z.
#include "haptic_core/penetration/facing_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/counting/work.h"

namespace farfeel::penetration {
namespace {

/// Triangles that stand steeper than 60 degrees to C's plane are no part of a height field: seen so askew, a texture is
/// stretched to several times its height and folds over.
constexpr double kLeastFacing = 0.5;
/// Newton never divides by less; steeper texture is flagged as grazing anyway.
constexpr double kLeastSlope = 0.05;
constexpr double kNewtonEnd_m = 1e-12;  ///< across the chart; the last step is still taken: what remains is its square
constexpr int kNewtonSteps = 12;
/// Beyond its own triangles a chart only continues them: a wall's goes on above the edge where the wall ends. A ray
/// that comes in askew and meets the surface no nearer than this has passed it by.
constexpr double kLeastDriftTexels = 4;
constexpr double kMet_m = 1e-7;  ///< ray and surface meet if the last step was shorter, and within the relief
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr HeightAlong kNothingThere{kNaN, kNaN, kNaN, kNaN, kNaN, kNaN};
/// Points this close outside an edge still count as on it: neighbours leave no gap between them.
constexpr double kOnEdge_m = 1e-12;
/// Two layers closer than this are one surface whose pieces meet.
constexpr double kLayerGap_m = 0.1e-3;

glm::dvec3 inside_of(const glm::dvec2& a, const glm::dvec2& b, double turn) {
  const glm::dvec2 along = b - a;
  const double length = glm::length(along);
  if (!(length > 0)) return {0, 0, 0};
  const glm::dvec2 inward = turn * glm::dvec2{-along.y, along.x} / length;
  return {-glm::dot(inward, a), inward.x, inward.y};
}

bool contains(const Facet& facet, const glm::dvec2& uv) {
  if (uv.x < facet.low.x || uv.x > facet.high.x || uv.y < facet.low.y || uv.y > facet.high.y) return false;
  for (const glm::dvec3& edge : facet.inside) {
    if (edge.x + edge.y * uv.x + edge.z * uv.y < -kOnEdge_m) return false;
  }
  return true;
}

double coarse_z(const Facet& facet, const glm::dvec2& uv) {
  return facet.plane.x + facet.plane.y * uv.x + facet.plane.z * uv.y;
}

}  // namespace

FacingPatch::FacingPatch(const Limits& limits) : marks_(limits.coarse_triangles, 0) {
  facing_.reserve(limits.coarse_triangles);
  facets_.reserve(limits.coarse_triangles);
  narrowed_.reserve(limits.coarse_triangles);
  edges_.reserve(3 * limits.coarse_triangles);
}

void FacingPatch::project(const Patch& patch, Side side, const Window& window) noexcept {
  surface_ = &patch.surface->haptic();
  outward_ = side == Side::kOutermost ? 1 : -1;
  facets_.clear();
  edges_.clear();
  ++stamp_;
  counting::count(Work::kTriangles, patch.triangles.size());
  const geometry::TriangleMesh& mesh = surface_->coarse;
  // A triangle counts if it faces along z, and so does the chart that its texture is measured from: a wall's chart
  // may hold a triangle that is less steep than the wall.
  const glm::dvec3 outward_O = glm::conjugate(patch.X_CO.R) * glm::dvec3{0, 0, outward_};
  std::uint32_t last_chart = geometry::kNoChart;
  bool chart_faces = true;
  facing_.clear();
  for (const std::uint32_t i : patch.triangles) {
    if (const std::uint32_t chart = surface_->triangle_chart[i]; chart != last_chart) {
      chart_faces =
          chart == geometry::kNoChart || glm::dot(outward_O, patch.surface->chart_axis_O(chart)) > kLeastFacing;
      last_chart = chart;
    }
    if (!chart_faces || !(glm::dot(outward_O, patch.surface->unit_normal_O(i)) > kLeastFacing)) continue;
    marks_[i] = stamp_;
    facing_.push_back(i);
  }
  const Window reached = within_fade_of(window);
  const glm::dmat3 R_CO = glm::mat3_cast(patch.X_CO.R);
  for (const std::uint32_t i : facing_) {
    Facet facet;
    for (std::size_t k = 0; k < 3; ++k) {
      facet.corners_C[k] = patch.X_CO.p + R_CO * mesh.positions_O[mesh.triangles[i][k]];
    }
    const auto& [a, b, c] = facet.corners_C;
    facet.low = glm::min(glm::min(glm::dvec2{a}, glm::dvec2{b}), glm::dvec2{c});
    facet.high = glm::max(glm::max(glm::dvec2{a}, glm::dvec2{b}), glm::dvec2{c});
    if (!overlaps(facet, reached)) continue;

    const glm::dvec3 n = R_CO * patch.surface->unit_normal_O(i);
    facet.plane = {a.z + (n.x * a.x + n.y * a.y) / n.z, -n.x / n.z, -n.y / n.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 &p = facet.corners_C[k], &q = facet.corners_C[(k + 1) % 3];
      facet.inside[k] = inside_of(glm::dvec2{p}, glm::dvec2{q}, outward_);
      const std::uint32_t across = patch.surface->neighbours(i)[k];
      if (across != kNoTriangle && marks_[across] == stamp_) continue;
      edges_.push_back({p, q, glm::min(glm::dvec2{p}, glm::dvec2{q}) - kEdgeFade_m,
                        glm::max(glm::dvec2{p}, glm::dvec2{q}) + kEdgeFade_m});
    }
    const std::uint32_t chart = surface_->triangle_chart[i];
    facet.chart_index = chart;
    facet.chart = chart == geometry::kNoChart ? nullptr : &surface_->charts[chart];
    facet.reach_up_m = facet.reach_down_m = facet.most_drift_m = 0;
    if (facet.chart) {
      if (!facets_.empty() && facets_.back().chart == facet.chart) {  // as most are that follow each other
        facet.R_HC = facets_.back().R_HC;
        facet.p_HC_H = facets_.back().p_HC_H;
      } else {
        const spatial::Pose X_HC = spatial::inverse(patch.X_CO * facet.chart->X_OH);
        facet.R_HC = glm::mat3_cast(X_HC.R);
        facet.p_HC_H = X_HC.p;
      }
      // Along z the surface leaves the plane by its relief times (chart's axis . n) / n.z.
      const glm::dvec3 axis_C{facet.R_HC[0].z, facet.R_HC[1].z, facet.R_HC[2].z};
      const double stretch = glm::dot(axis_C, n) / n.z;  // positive for S, negative for T
      const Relief& relief = patch.surface->relief(i);
      facet.most_drift_m = std::max(kLeastDriftTexels * facet.chart->texel_m, 0.5 * (relief.high_m - relief.low_m));
      facet.reach_up_m = std::max(relief.low_m * stretch, relief.high_m * stretch);
      facet.reach_down_m = std::min(relief.low_m * stretch, relief.high_m * stretch);
    }
    facets_.push_back(facet);
  }
}

void FacingPatch::narrow(const Window& window) noexcept {
  narrowed_.clear();
  for (std::uint32_t i = 0; i < facets_.size(); ++i) {
    if (overlaps(facets_[i], window)) narrowed_.push_back(i);
  }
}

const Facet* FacingPatch::narrowed_facet_at(const glm::dvec2& uv_m) const noexcept {
  const Facet* felt = nullptr;
  double felt_z = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : narrowed_) {
    if (!contains(facets_[i], uv_m)) continue;
    const double z = outward_ * coarse_z(facets_[i], uv_m);
    if (z > felt_z) felt = &facets_[i], felt_z = z;
  }
  return felt;
}

const Facet* FacingPatch::facet_at(const glm::dvec2& uv_m) const noexcept {
  const Facet* felt = nullptr;
  double felt_z = -std::numeric_limits<double>::infinity();
  for (const Facet& facet : facets_) {
    if (!contains(facet, uv_m)) continue;
    const double z = outward_ * coarse_z(facet, uv_m);
    if (z > felt_z) felt = &facet, felt_z = z;
  }
  return felt;
}

bool FacingPatch::has_several_layers_at(const glm::dvec2& uv_m) const noexcept {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Facet& facet : facets_) {
    if (!contains(facet, uv_m)) continue;
    low = std::min(low, coarse_z(facet, uv_m));
    high = std::max(high, coarse_z(facet, uv_m));
  }
  return high - low > kLayerGap_m;
}

HeightAlong FacingPatch::height_at(const Facet& facet, const glm::dvec2& uv_m) const noexcept {
  double z = coarse_z(facet, uv_m);
  if (!facet.chart) return {z, facet.plane.y, facet.plane.z, 0, 0, 0};

  const glm::dmat3& R = facet.R_HC;  // R[k] is C's axis k written in H
  const glm::dvec3 base = facet.p_HC_H + R[0] * uv_m.x + R[1] * uv_m.y;
  const double toward = R[2].z < 0 ? -1 : 1;  // C's z goes with or against the chart's outward axis
  const double across = std::sqrt(R[2].x * R[2].x + R[2].y * R[2].y);  // of the chart, per step along the ray
  const double lowest = z + facet.reach_down_m, highest = z + facet.reach_up_m;
  geometry::HeightSample h{};
  glm::dvec3 G_H{0};
  double G_z = 1;
  bool has_met = false;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const glm::dvec3 p = base + R[2] * z;
    h = geometry::sample_height(*surface_, *facet.chart, p.x, p.y);
    G_H = {-h.h_s, -h.h_t, 1};
    G_z = glm::dot(R[2], G_H);
    if (!(toward * G_z > kLeastSlope)) G_z = toward * kLeastSlope;
    const double dz = -(p.z - h.h_m) / G_z;
    const double next_z = std::clamp(z + dz, lowest, highest);  // texture steeper than the ray lets Newton run away
    has_met = std::abs(next_z - (z + dz)) < kMet_m && std::abs(dz) * across < kMet_m;
    z = next_z;
    if (std::abs(dz) * across < kNewtonEnd_m) break;
  }
  if (!has_met || std::abs(z - coarse_z(facet, uv_m)) * across > facet.most_drift_m) return kNothingThere;
  const auto second = [&](int i, int j) {
    return -(h.h_ss_1_per_m * R[i].x * R[j].x + h.h_st_1_per_m * (R[i].x * R[j].y + R[i].y * R[j].x) +
             h.h_tt_1_per_m * R[i].y * R[j].y);
  };
  const double z_u = -glm::dot(R[0], G_H) / G_z, z_v = -glm::dot(R[1], G_H) / G_z;
  const double Q_uz = second(0, 2), Q_vz = second(1, 2), Q_zz = second(2, 2);
  return {.z_m = z,
          .z_u = z_u,
          .z_v = z_v,
          .z_uu_1_per_m = -(second(0, 0) + 2 * Q_uz * z_u + Q_zz * z_u * z_u) / G_z,
          .z_uv_1_per_m = -(second(0, 1) + Q_uz * z_v + Q_vz * z_u + Q_zz * z_u * z_v) / G_z,
          .z_vv_1_per_m = -(second(1, 1) + 2 * Q_vz * z_v + Q_zz * z_v * z_v) / G_z};
}

EdgeFade FacingPatch::fade_at(const glm::dvec2& uv_m) const noexcept {
  double least_square = kEdgeFade_m * kEdgeFade_m;
  EdgeFade fade;
  bool is_near = false;
  for (const PatchEdge& edge : edges_) {
    if (uv_m.x < edge.low.x || uv_m.x > edge.high.x || uv_m.y < edge.low.y || uv_m.y > edge.high.y) continue;
    const glm::dvec2 a{edge.a_C}, along = glm::dvec2{edge.b_C} - a;
    const double square = glm::dot(along, along);
    const double share = square > 0 ? std::clamp(glm::dot(uv_m - a, along) / square, 0.0, 1.0) : 0.0;
    const glm::dvec2 away = uv_m - (a + share * along);
    if (glm::dot(away, away) >= least_square) continue;
    least_square = glm::dot(away, away);
    fade.inward = away;
    fade.p_CFoot_C = glm::mix(edge.a_C, edge.b_C, share);
    is_near = true;
  }
  if (!is_near) return {};
  const double distance_m = std::sqrt(least_square), x = distance_m / kEdgeFade_m;
  fade.inward = distance_m > 0 ? fade.inward / distance_m : glm::dvec2{0};
  fade.keep = x * x * (3 - 2 * x);
  fade.keep_slope_1_per_m = 6 * x * (1 - x) / kEdgeFade_m;
  fade.keep_curvature_1_per_m2 = 6 * (1 - 2 * x) / (kEdgeFade_m * kEdgeFade_m);
  return fade;
}

}  // namespace farfeel::penetration
