#include "codecs/asset/chart_frame.h"

#include <cmath>
#include <limits>

namespace farfeel::codecs {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

glm::dvec3 area_vector(const TriangleMesh& mesh, std::uint32_t t) {
  const Triangle& v = mesh.triangles[t];
  const glm::dvec3& a = mesh.positions_O[v[0]];
  return 0.5 * glm::cross(mesh.positions_O[v[1]] - a, mesh.positions_O[v[2]] - a);
}

}  // namespace

ChartFrame chart_frame(const TriangleMesh& mesh, std::span<const std::uint32_t> group) {
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

  ChartFrame best;
  double least = std::numeric_limits<double>::infinity();
  constexpr int kTurns = 90;  // one degree apart over a quarter turn
  for (int turn = 0; turn < kTurns; ++turn) {
    const spatial::Pose X_OC{level * spatial::rotation_from_vector({0, 0, turn * (glm::pi<double>() / 2) / kTurns}),
                             centre};
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const std::uint32_t t : group) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        const glm::dvec2 p(spatial::rotate_back(X_OC, mesh.positions_O[v] - centre));
        low = glm::min(low, p), high = glm::max(high, p);
      }
    }
    const glm::dvec2 size = high - low;
    if (size.x * size.y >= least) continue;
    least = size.x * size.y;
    best = {.X_OC = X_OC, .patch_low_m = low, .patch_size_m = size};
  }
  return best;
}

std::uint32_t texels_along(double patch_m, double texel_m) {
  return static_cast<std::uint32_t>(std::ceil(patch_m / texel_m)) + 2 * kChartMargin;
}

geometry::Chart placed_chart(const ChartFrame& frame, double texel_m) {
  geometry::Chart chart{.X_OH = frame.X_OC,
                        .texel_m = texel_m,
                        .columns = texels_along(frame.patch_size_m.x, texel_m),
                        .rows = texels_along(frame.patch_size_m.y, texel_m),
                        .first_tile = 0};
  const glm::dvec2 rectangle = texel_m * glm::dvec2(chart.columns, chart.rows);
  const glm::dvec2 corner = frame.patch_low_m - 0.5 * (rectangle - frame.patch_size_m);
  chart.X_OH.p += spatial::rotate(chart.X_OH, glm::dvec3(corner, 0));
  return chart;
}

}  // namespace farfeel::codecs
