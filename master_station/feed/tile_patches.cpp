#include "master_station/feed/tile_patches.h"

#include <algorithm>

namespace farfeel::master_station {
namespace {

using geometry::Chart;

struct Rectangle {
  glm::dvec2 low, high;  // in the chart's plane [m]
  [[nodiscard]] std::array<glm::dvec2, 4> corners() const { return {low, {high.x, low.y}, high, {low.x, high.y}}; }
};

/// Convex shapes are apart where a side's normal keeps them apart.
template <typename A, typename B>
bool are_apart_along(const glm::dvec2& normal, const A& a, const B& b) {
  const auto reach = [&](const auto& shape) {
    double low = glm::dot(normal, shape[0]), high = low;
    for (const glm::dvec2& p : shape)
      low = std::min(low, glm::dot(normal, p)), high = std::max(high, glm::dot(normal, p));
    return std::pair(low, high);
  };
  const auto [a_low, a_high] = reach(a);
  const auto [b_low, b_high] = reach(b);
  return a_high < b_low || b_high < a_low;
}

bool touch(const Rectangle& rectangle, const std::array<glm::dvec2, 3>& triangle) {
  const auto corners = rectangle.corners();
  if (are_apart_along({1, 0}, corners, triangle) || are_apart_along({0, 1}, corners, triangle)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec2 side = triangle[(i + 1) % 3] - triangle[i];
    if (are_apart_along({-side.y, side.x}, corners, triangle)) return false;
  }
  return true;
}

Rectangle rectangle_of(const Chart& chart, std::uint32_t across, std::uint32_t down) {
  const auto at = [&](std::uint32_t tile, std::uint32_t most) {
    return chart.texel_m * std::min(tile * geometry::kTileTexels, most);
  };
  return {{at(across, chart.columns), at(down, chart.rows)}, {at(across + 1, chart.columns), at(down + 1, chart.rows)}};
}

}  // namespace

std::vector<TilePatch> tile_patches(const geometry::HapticSurface& surface) {
  std::vector<std::vector<std::array<glm::dvec2, 3>>> triangles(surface.charts.size());  // of each chart, in its plane
  for (std::size_t i = 0; i < surface.triangle_chart.size(); ++i) {
    const std::uint32_t chart = surface.triangle_chart[i];
    if (chart == geometry::kNoChart) continue;
    const spatial::Pose X_HO = spatial::inverse(surface.charts[chart].X_OH);
    std::array<glm::dvec2, 3> flat;
    for (std::size_t k = 0; k < 3; ++k)
      flat[k] = glm::dvec2(spatial::transform_point(X_HO, surface.coarse.positions_O[surface.coarse.triangles[i][k]]));
    triangles[chart].push_back(flat);
  }
  std::vector<TilePatch> patches;
  for (std::size_t c = 0; c < surface.charts.size(); ++c) {
    const Chart& chart = surface.charts[c];
    for (std::uint32_t down = 0; down < chart.tiles_down(); ++down) {
      for (std::uint32_t across = 0; across < chart.tiles_across(); ++across) {
        const Rectangle rectangle = rectangle_of(chart, across, down);
        if (std::none_of(triangles[c].begin(), triangles[c].end(),
                         [&](const auto& triangle) { return touch(rectangle, triangle); }))
          continue;
        TilePatch patch{chart.first_tile + down * chart.tiles_across() + across, {}};
        const auto corners = rectangle.corners();
        for (std::size_t k = 0; k < 4; ++k) {
          const double height_m = geometry::sample_height(surface, chart, corners[k].x, corners[k].y).h_m;
          patch.corner_O[k] = spatial::transform_point(chart.X_OH, {corners[k].x, corners[k].y, height_m});
        }
        patches.push_back(patch);
      }
    }
  }
  return patches;
}

}  // namespace farfeel::master_station
