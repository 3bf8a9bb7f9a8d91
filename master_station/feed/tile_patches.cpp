#include "master_station/feed/tile_patches.h"

#include <algorithm>
#include <cmath>

namespace farfeel::master_station {
namespace {

using geometry::Chart;
using Polygon = std::vector<glm::dvec2>;  // convex, in the chart's plane [m]

constexpr double kLeast_m2 = 1e-12;  // what is left of a cut that goes along an edge

/// What of it lies where along * p <= most (Sutherland & Hodgman, one side).
Polygon cut(const Polygon& polygon, const glm::dvec2& along, double most) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double out_from = glm::dot(along, from) - most, out_to = glm::dot(along, to) - most;
    if (out_from <= 0) kept.push_back(from);
    if ((out_from < 0 && out_to > 0) || (out_from > 0 && out_to < 0))
      kept.push_back(from + out_from / (out_from - out_to) * (to - from));
  }
  return kept;
}

double area_m2(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
}

/// The tiles across, or down, that reach from low to high; those at the border have all beyond it.
std::pair<std::uint32_t, std::uint32_t> tiles_between(double low_m, double high_m, const Chart& chart,
                                                      std::uint32_t count) {
  const double side_m = chart.texel_m * geometry::kTileTexels;
  const auto tile = [&](double at_m) {
    return static_cast<std::uint32_t>(std::clamp(std::floor(at_m / side_m), 0.0, count - 1.0));
  };
  return {tile(low_m), tile(high_m)};
}

class Patches {
 public:
  explicit Patches(const geometry::HapticSurface& surface) : surface_(surface), of_tile_(surface.tiles.size()) {}

  void add(const Chart& chart, const Polygon& triangle) {
    glm::dvec2 low = triangle[0], high = triangle[0];
    for (const glm::dvec2& p : triangle) low = glm::min(low, p), high = glm::max(high, p);
    const auto [left, right] = tiles_between(low.x, high.x, chart, chart.tiles_across());
    const auto [top, bottom] = tiles_between(low.y, high.y, chart, chart.tiles_down());
    const double side_m = chart.texel_m * geometry::kTileTexels;
    for (std::uint32_t down = top; down <= bottom; ++down) {
      for (std::uint32_t across = left; across <= right; ++across) {
        Polygon part = triangle;
        if (across > left) part = cut(part, {-1, 0}, -side_m * across);
        if (across < right) part = cut(part, {1, 0}, side_m * (across + 1));
        if (down > top) part = cut(part, {0, -1}, -side_m * down);
        if (down < bottom) part = cut(part, {0, 1}, side_m * (down + 1));
        for (std::size_t i = 2; i < part.size(); ++i) {
          if (area_m2(part[0], part[i - 1], part[i]) < kLeast_m2) continue;
          of_tile_[chart.first_tile + down * chart.tiles_across() + across].push_back(
              {lifted(chart, part[0]), lifted(chart, part[i - 1]), lifted(chart, part[i])});
        }
      }
    }
  }

  [[nodiscard]] std::vector<TilePatch> taken() {
    std::vector<TilePatch> patches;
    for (std::uint32_t tile = 0; tile < of_tile_.size(); ++tile)
      if (!of_tile_[tile].empty()) patches.push_back({tile, std::move(of_tile_[tile])});
    return patches;
  }

 private:
  [[nodiscard]] glm::dvec3 lifted(const Chart& chart, const glm::dvec2& p) const {
    const double height_m = geometry::sample_height(surface_, chart, p.x, p.y).h_m;
    return spatial::transform_point(chart.X_OH, {p.x, p.y, height_m});
  }

  const geometry::HapticSurface& surface_;
  std::vector<std::vector<std::array<glm::dvec3, 3>>> of_tile_;
};

}  // namespace

std::vector<TilePatch> tile_patches(const geometry::HapticSurface& surface) {
  Patches patches(surface);
  for (std::size_t i = 0; i < surface.triangle_chart.size(); ++i) {
    if (surface.triangle_chart[i] == geometry::kNoChart) continue;
    const Chart& chart = surface.charts[surface.triangle_chart[i]];
    const spatial::Pose X_HO = spatial::inverse(chart.X_OH);
    Polygon triangle;
    for (const std::uint32_t corner : surface.coarse.triangles[i])
      triangle.emplace_back(spatial::transform_point(X_HO, surface.coarse.positions_O[corner]));
    patches.add(chart, triangle);
  }
  return patches.taken();
}

}  // namespace farfeel::master_station
