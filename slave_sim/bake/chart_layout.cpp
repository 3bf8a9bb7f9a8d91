#include "slave_sim/bake/chart_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "slave_sim/bake/convex_pieces.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

glm::dvec3 area_vector(const TriangleMesh& mesh, std::uint32_t t) {
  const Triangle& v = mesh.triangles[t];
  const glm::dvec3& a = mesh.positions_O[v[0]];
  return 0.5 * glm::cross(mesh.positions_O[v[1]] - a, mesh.positions_O[v[2]] - a);
}

/// Every triangle of the group within the cone about the group's mean normal.
bool agrees(const TriangleMesh& mesh, const std::vector<std::uint32_t>& group, const glm::dvec3& mean) {
  return std::all_of(group.begin(), group.end(), [&](std::uint32_t t) {
    const glm::dvec3 n = geometry::unit_normal(mesh, mesh.triangles[t]);
    return n == glm::dvec3(0) || glm::dot(n, mean) >= std::cos(kChartCone_rad);
  });
}

std::vector<std::vector<std::uint32_t>> groups_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& piece) {
  const std::vector<Triangle> neighbours = triangle_neighbours(mesh);
  std::vector<std::uint32_t> by_area(mesh.triangles.size()), group_of(mesh.triangles.size(), kFree);
  std::iota(by_area.begin(), by_area.end(), 0);
  std::stable_sort(by_area.begin(), by_area.end(), [&](std::uint32_t a, std::uint32_t b) {
    return glm::length(area_vector(mesh, a)) > glm::length(area_vector(mesh, b));
  });
  std::vector<std::vector<std::uint32_t>> groups;
  for (const std::uint32_t seed : by_area) {
    if (group_of[seed] != kFree) continue;
    const auto name = static_cast<std::uint32_t>(groups.size());
    std::vector<std::uint32_t> group{seed};
    group_of[seed] = name;
    glm::dvec3 sum = area_vector(mesh, seed);
    for (std::size_t i = 0; i < group.size(); ++i) {
      for (const std::uint32_t n : neighbours[group[i]]) {
        if (group_of[n] != kFree || piece[n] != piece[seed]) continue;
        const glm::dvec3 grown = sum + area_vector(mesh, n);
        group.push_back(n);
        if (glm::length(grown) > 0 && agrees(mesh, group, glm::normalize(grown))) {
          sum = grown;
          group_of[n] = name;
        } else {
          group.pop_back();
        }
      }
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

/// A frame for the group: z its mean normal, x the direction that makes its rectangle smallest.
ChartPlan planned(const TriangleMesh& mesh, std::vector<std::uint32_t> group) {
  glm::dvec3 sum(0), moment(0);
  double area = 0;
  for (const std::uint32_t t : group) {
    const glm::dvec3 a = area_vector(mesh, t);
    const Triangle& v = mesh.triangles[t];
    sum += a;
    area += glm::length(a);
    moment += glm::length(a) / 3 * (mesh.positions_O[v[0]] + mesh.positions_O[v[1]] + mesh.positions_O[v[2]]);
  }
  const glm::dvec3 z = glm::length(sum) > 0 ? glm::normalize(sum) : glm::dvec3(0, 0, 1);
  const glm::dvec3 centre = area > 0 ? moment / area : mesh.positions_O[mesh.triangles[group[0]][0]];
  const glm::dquat level = spatial::frame_with_z(z);

  ChartPlan best;
  best.triangles = std::move(group);
  double least = std::numeric_limits<double>::infinity();
  constexpr int kTurns = 90;  // one degree apart over a quarter turn
  for (int turn = 0; turn < kTurns; ++turn) {
    const spatial::Pose X_OC{level * spatial::rotation_from_vector({0, 0, turn * (glm::pi<double>() / 2) / kTurns}),
                             centre};
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const std::uint32_t t : best.triangles) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        const glm::dvec2 p(spatial::rotate_back(X_OC, mesh.positions_O[v] - centre));
        low = glm::min(low, p), high = glm::max(high, p);
      }
    }
    const glm::dvec2 size = high - low;
    if (size.x * size.y >= least) continue;
    least = size.x * size.y;
    best.X_OH = X_OC;
    best.patch_low_m = low;
    best.patch_size_m = size;
  }
  return best;
}

std::uint64_t resize(std::vector<ChartPlan>& charts, double texel_m) {
  std::uint64_t texels = 0;
  for (ChartPlan& chart : charts) {
    chart.columns = static_cast<std::uint32_t>(std::ceil(chart.patch_size_m.x / texel_m)) + 2 * kChartMargin;
    chart.rows = static_cast<std::uint32_t>(std::ceil(chart.patch_size_m.y / texel_m)) + 2 * kChartMargin;
    texels += static_cast<std::uint64_t>(chart.columns) * chart.rows;
  }
  return texels;
}

}  // namespace

ChartLayout chart_layout(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangle_piece,
                         std::uint32_t texture) {
  ChartLayout layout;
  layout.triangle_chart.resize(mesh.triangles.size());
  for (std::vector<std::uint32_t>& group : groups_of(mesh, triangle_piece)) {
    for (const std::uint32_t t : group) layout.triangle_chart[t] = static_cast<std::uint32_t>(layout.charts.size());
    layout.charts.push_back(planned(mesh, std::move(group)));
  }

  const std::uint64_t budget = static_cast<std::uint64_t>(texture) * texture;
  const double size_m = glm::length(geometry::bounding_box(mesh).size());
  double fine = size_m / 65536, coarse = size_m;  // texels: too many and too few
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(fine * coarse);
    (resize(layout.charts, middle) > budget ? fine : coarse) = middle;
  }
  layout.texel_m = coarse;
  resize(layout.charts, layout.texel_m);
  for (ChartPlan& chart : layout.charts) {  // the patch in the rectangle's middle, the origin at the rectangle's corner
    const glm::dvec2 rectangle = layout.texel_m * glm::dvec2(chart.columns, chart.rows);
    const glm::dvec2 corner = chart.patch_low_m - 0.5 * (rectangle - chart.patch_size_m);
    chart.X_OH.p += spatial::rotate(chart.X_OH, glm::dvec3(corner, 0));
    chart.patch_low_m -= corner;
  }
  return layout;
}

}  // namespace farfeel::slave_sim
