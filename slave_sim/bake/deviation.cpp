#include "slave_sim/bake/deviation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "slave_sim/bake/convex_pieces.h"
#include "slave_sim/bake/left_out.h"
#include "slave_sim/bake/surface_points.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Chart;
using geometry::HapticSurface;

/// Of the mesh that stands for the felt surface where no chart has an answer of its own.
constexpr std::uint64_t kMostFeltPoints = 1'200'000;

class Sum {
 public:
  /// Weight: of the area that this stands for.
  void add(double distance, double weight, const glm::dvec3& p_O = {}) {
    square_ += weight * distance * distance;
    weight_ += weight;
    if (distance > max_) max_ = distance, p_max_O_ = p_O;
    all_.emplace_back(distance, weight);
  }
  [[nodiscard]] double rms() const { return weight_ > 0 ? std::sqrt(square_ / weight_) : 0; }
  [[nodiscard]] Deviation deviation() {
    std::sort(all_.begin(), all_.end());
    return {.rms_m = rms(), .max_m = max_, .p99_m = within(0.99), .p999_m = within(0.999), .p_max_M = p_max_O_};
  }
  [[nodiscard]] SlopeDeviation slope() const { return {.rms = rms(), .max = max_}; }

 private:
  /// What that share of the weight is within. Precondition: sorted.
  [[nodiscard]] double within(double share) const {
    double below = 0;
    for (const auto& [distance, weight] : all_) {
      below += weight;
      if (below > share * weight_) return distance;
    }
    return max_;
  }

  double square_ = 0, weight_ = 0, max_ = 0;
  glm::dvec3 p_max_O_{0};
  std::vector<std::pair<double, double>> all_;
};

glm::dvec3 normal_O(const Chart& chart, const geometry::HeightSample& h) {
  return spatial::rotate(chart.X_OH, glm::normalize(glm::dvec3(-h.h_s, -h.h_t, 1)));
}

/// An own texel within `near` texels of the one at (i, j).
bool has_own_near(const BakedChart& baked, int i, int j, int near) {
  const int columns = static_cast<int>(baked.heights.columns), rows = static_cast<int>(baked.heights.rows);
  for (int b = std::max(0, j - near); b <= std::min(rows - 1, j + near); ++b) {
    for (int a = std::max(0, i - near); a <= std::min(columns - 1, i + near); ++a) {
      if (baked.is_own[static_cast<std::size_t>(b) * baked.heights.columns + a]) return true;
    }
  }
  return false;
}

/// Distance along the displaced surface's normal from p_O to one chart; infinite where the chart has nothing to say.
double distance_to_chart(const HapticSurface& surface, const Chart& chart, const BakedChart& baked,
                         const glm::dvec3& p_O) {
  const glm::dvec3 p_H = spatial::rotate_back(chart.X_OH, p_O - chart.X_OH.p);
  const double s = p_H.x / chart.texel_m, t = p_H.y / chart.texel_m;
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  if (!(s >= 0 && t >= 0 && s < chart.columns && t < chart.rows)) return kNowhere;
  constexpr int kNear = 2;
  if (!has_own_near(baked, static_cast<int>(s), static_cast<int>(t), kNear)) return kNowhere;
  const geometry::HeightSample h = geometry::sample_height(surface, chart, p_H.x, p_H.y);
  return std::abs(p_H.z - h.h_m) / std::sqrt(1 + h.h_s * h.h_s + h.h_t * h.h_t);
}

/// The displaced surface over the charts' own triangles as a mesh through the centres of every stride-th texel.
geometry::TriangleMesh felt_mesh(const HapticSurface& surface, const std::vector<BakedChart>& baked,
                                 std::uint32_t stride) {
  constexpr std::uint32_t kNone = 0xFFFF'FFFF;
  geometry::TriangleMesh mesh;
  for (std::size_t c = 0; c < baked.size(); ++c) {
    const Chart& chart = surface.charts[c];
    const std::uint32_t across = (chart.columns + stride - 1) / stride, down = (chart.rows + stride - 1) / stride;
    std::vector<std::uint32_t> name(static_cast<std::size_t>(across) * down, kNone);
    for (std::uint32_t n = 0; n < name.size(); ++n) {
      const std::uint32_t i = n % across * stride, j = n / across * stride;
      if (!baked[c].is_own[static_cast<std::size_t>(j) * chart.columns + i]) continue;
      const double s = (i + 0.5) * chart.texel_m, t = (j + 0.5) * chart.texel_m;
      name[n] = static_cast<std::uint32_t>(mesh.positions_O.size());
      const double h_m = geometry::sample_height(surface, chart, s, t).h_m;
      mesh.positions_O.push_back(spatial::transform_point(chart.X_OH, {s, t, h_m}));
      if (n < across || n % across == 0) continue;
      const std::uint32_t left = name[n - 1], below = name[n - across], corner = name[n - across - 1];
      if (corner == kNone) continue;
      if (below != kNone) mesh.triangles.push_back({corner, below, name[n]});
      if (left != kNone) mesh.triangles.push_back({corner, name[n], left});
    }
  }
  return mesh;
}

}  // namespace

Deviation full_to_felt(const geometry::TriangleMesh& full, const geometry::TriangleMesh& left_out,
                       const HapticSurface& surface, const std::vector<BakedChart>& baked, std::uint32_t samples) {
  std::vector<geometry::Box> boxes(surface.charts.size());
  for (std::size_t t = 0; t < surface.coarse.triangles.size(); ++t) {
    for (const std::uint32_t v : surface.coarse.triangles[t]) {
      boxes[surface.triangle_chart[t]].include(surface.coarse.positions_O[v]);
    }
  }
  const double slack_m = 0.05 * glm::length(geometry::bounding_box(surface.coarse).size());

  std::uint64_t own = 0;
  for (const BakedChart& chart : baked) own += chart.own;
  const auto stride =
      static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(own) / static_cast<double>(kMostFeltPoints))));
  const geometry::TriangleMesh felt = felt_mesh(surface, baked, stride);
  const FullSurface felt_surface(felt.triangles.empty() ? surface.coarse : felt);  // texels may be too large for any
  const auto distance_m = [&](const glm::dvec3& p_O, const glm::dvec3& n_O) {
    double least_m = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < surface.charts.size(); ++c) {
      if (glm::any(glm::lessThan(p_O, boxes[c].low - slack_m)) ||
          glm::any(glm::greaterThan(p_O, boxes[c].high + slack_m)))
        continue;
      if (glm::dot(n_O, spatial::rotate(surface.charts[c].X_OH, {0, 0, 1})) <= 0) continue;
      least_m = std::min(least_m, distance_to_chart(surface, surface.charts[c], baked[c], p_O));
    }
    return least_m > surface.charts.front().texel_m ? std::min(least_m, felt_surface.distance_m(p_O)) : least_m;
  };
  geometry::TriangleMesh all = full;
  append(all, left_out);
  SurfacePoints points(all, 1);
  Sum sum;
  for (std::uint32_t n = 0; n < samples; ++n) {
    const SurfacePoints::Point point = points.next();
    sum.add(distance_m(point.p_O, point.nhat_O), 1, point.p_O);
  }
  for (const glm::dvec3& p_O : left_out.positions_O) sum.add(felt_surface.distance_m(p_O), 0, p_O);
  return sum.deviation();
}

double median_thickness_m(const geometry::TriangleMesh& mesh, const FullSurface& surface, std::uint32_t samples) {
  SurfacePoints points(mesh, 3);
  std::vector<double> found_m;
  for (std::uint32_t n = 0; n < samples; ++n) {
    const SurfacePoints::Point point = points.next();
    if (const auto way_m = surface.thickness_m(point.p_O, -point.nhat_O, 0)) found_m.push_back(*way_m);
  }
  if (found_m.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = found_m.begin() + static_cast<std::ptrdiff_t>(found_m.size() / 2);
  std::nth_element(found_m.begin(), middle, found_m.end());
  return *middle;
}

FeltDeviation felt_to_full(const HapticSurface& surface, const std::vector<BakedChart>& baked, const FullSurface& full,
                           std::uint32_t samples) {
  std::uint64_t own = 0;
  for (const BakedChart& chart : baked) own += chart.own;
  const double share = own == 0 ? 0 : std::min(1.0, static_cast<double>(samples) / static_cast<double>(own));
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  Sum height, slope;
  for (std::size_t c = 0; c < baked.size(); ++c) {
    const Chart& chart = surface.charts[c];
    for (std::size_t texel = 0; texel < baked[c].is_own.size(); ++texel) {
      if (!baked[c].is_own[texel] || unit(random) > share) continue;
      const double s = (static_cast<double>(texel % chart.columns) + unit(random)) * chart.texel_m;
      const double t = (static_cast<double>(texel / chart.columns) + unit(random)) * chart.texel_m;
      const geometry::HeightSample h = geometry::sample_height(surface, chart, s, t);
      const glm::dvec3 p_O = spatial::transform_point(chart.X_OH, {s, t, h.h_m});
      const FullSurface::Nearest nearest = full.nearest(p_O);
      const double area = std::sqrt(1 + h.h_s * h.h_s + h.h_t * h.h_t);  // over a texel's
      height.add(nearest.distance_m, area, p_O);
      const double turn = glm::length(normal_O(chart, h) - nearest.nhat_O);
      constexpr double kOtherSide = 1;  // 60 degrees
      if (turn < kOtherSide) slope.add(turn, area);
    }
  }
  return {height.deviation(), slope.slope()};
}

FeltDeviation seam_steps(const HapticSurface& surface) {
  constexpr double kSmooth = 0.866;  // cos 30 degrees
  constexpr int kPoints = 8;         // along an edge
  const std::vector<geometry::Triangle> neighbours = triangle_neighbours(surface.coarse);
  Sum height, slope;
  for (std::uint32_t t = 0; t < neighbours.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = neighbours[t][k];
      if (surface.triangle_chart[t] >= surface.triangle_chart[other]) continue;  // each border once
      const geometry::Triangle& v = surface.coarse.triangles[t];
      const glm::dvec3 n = geometry::unit_normal(surface.coarse, v);
      if (glm::dot(n, geometry::unit_normal(surface.coarse, surface.coarse.triangles[other])) < kSmooth) continue;
      const Chart &from = surface.charts[surface.triangle_chart[t]],
                  &to = surface.charts[surface.triangle_chart[other]];
      for (int i = 0; i < kPoints; ++i) {
        const double along = (i + 0.5) / kPoints;
        const glm::dvec3 edge_O =
            glm::mix(surface.coarse.positions_O[v[k]], surface.coarse.positions_O[v[(k + 1) % 3]], along);
        const glm::dvec3 in_from = spatial::rotate_back(from.X_OH, edge_O - from.X_OH.p);
        const geometry::HeightSample h_from = geometry::sample_height(surface, from, in_from.x, in_from.y);
        const glm::dvec3 felt_O = spatial::transform_point(from.X_OH, {in_from.x, in_from.y, h_from.h_m});
        const glm::dvec3 in_to = spatial::rotate_back(to.X_OH, felt_O - to.X_OH.p);
        const geometry::HeightSample h_to = geometry::sample_height(surface, to, in_to.x, in_to.y);
        const glm::dvec3 n_to = normal_O(to, h_to);
        height.add(std::abs(in_to.z - h_to.h_m) * glm::dot(n_to, spatial::rotate(to.X_OH, {0, 0, 1})), 1, felt_O);
        slope.add(glm::length(normal_O(from, h_from) - n_to), 1);
      }
    }
  }
  return {height.deviation(), slope.slope()};
}

void tell_deviation(const Given& given, const HapticSurface& felt, const std::vector<BakedChart>& baked,
                    BakeReport& report) {
  constexpr std::uint32_t kSamples = 60'000;
  report.full_to_felt = full_to_felt(given.full, given.left_out, felt, baked, kSamples);
  const FeltDeviation own = felt_to_full(felt, baked, given.surface, kSamples), seams = seam_steps(felt);
  report.felt_to_full = own.height, report.felt_slope = own.slope;
  report.seam_step = seams.height, report.seam_slope = seams.slope;
  for (Deviation* each : {&report.full_to_felt, &report.felt_to_full, &report.seam_step})
    each->p_max_M += report.p_MO_M;
  report.texels = report.missed_texels = 0;
  for (const BakedChart& chart : baked) report.texels += chart.own, report.missed_texels += chart.missed;
}

}  // namespace farfeel::slave_sim
