#include "slave_sim/bake/chart_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "codecs/asset/chart_frame.h"
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

std::uint64_t texels_of(const std::vector<codecs::ChartFrame>& frames, double texel_m) {
  std::uint64_t texels = 0;
  for (const codecs::ChartFrame& frame : frames)
    texels += std::uint64_t{codecs::texels_along(frame.patch_size_m.x, texel_m)} *
              codecs::texels_along(frame.patch_size_m.y, texel_m);
  return texels;
}

}  // namespace

ChartLayout chart_layout(const TriangleMesh& mesh, const std::vector<std::uint32_t>& triangle_piece,
                         std::uint32_t texture) {
  ChartLayout layout;
  layout.triangle_chart.resize(mesh.triangles.size());
  std::vector<codecs::ChartFrame> frames;
  for (std::vector<std::uint32_t>& group : groups_of(mesh, triangle_piece)) {
    for (const std::uint32_t t : group) layout.triangle_chart[t] = static_cast<std::uint32_t>(layout.charts.size());
    frames.push_back(codecs::chart_frame(mesh, group));
    layout.charts.push_back({.triangles = std::move(group)});
  }

  const std::uint64_t budget = static_cast<std::uint64_t>(texture) * texture;
  const double size_m = glm::length(geometry::bounding_box(mesh).size());
  double fine = size_m / 65536, coarse = size_m;  // texels: too many and too few
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(fine * coarse);
    (texels_of(frames, middle) > budget ? fine : coarse) = middle;
  }
  layout.texel_m = coarse;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const geometry::Chart placed = codecs::placed_chart(frames[i], layout.texel_m);
    layout.charts[i].X_OH = placed.X_OH;
    layout.charts[i].columns = placed.columns, layout.charts[i].rows = placed.rows;
  }
  return layout;
}

}  // namespace farfeel::slave_sim
