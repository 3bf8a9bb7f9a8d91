#include "codecs/asset/chart_heights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>

namespace farfeel::codecs {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct Grid {
  int columns, rows;
  std::vector<double> z;  ///< NaN where unknown

  [[nodiscard]] bool has(int i, int j) const { return i >= 0 && j >= 0 && i < columns && j < rows; }
  double& at(int i, int j) { return z[static_cast<std::size_t>(j) * columns + i]; }
  [[nodiscard]] double at_or_unknown(int i, int j) const {
    return has(i, j) ? z[static_cast<std::size_t>(j) * columns + i] : kUnknown;
  }
};

constexpr std::array<std::array<int, 2>, 4> kSteps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// The mean, over known neighbours, of going on from them: `straightness` 1 keeps their slope, 0 their height.
double continued(const Grid& grid, int i, int j, double straightness) {
  double sum = 0;
  int count = 0;
  for (const auto& [di, dj] : kSteps) {
    const double near = grid.at_or_unknown(i + di, j + dj);
    if (std::isnan(near)) continue;
    const double far = grid.at_or_unknown(i + 2 * di, j + 2 * dj);
    sum += std::isnan(far) ? near : near + straightness * (near - far);
    ++count;
  }
  return count == 0 ? kUnknown : sum / count;
}

/// The coarse triangles' height over the plane at every texel centre they cover, NaN elsewhere.
Grid coarse_heights(const geometry::TriangleMesh& coarse, std::span<const std::uint32_t> triangles,
                    const geometry::Chart& chart) {
  const double texel_m = chart.texel_m;
  Grid grid{static_cast<int>(chart.columns), static_cast<int>(chart.rows),
            std::vector<double>(static_cast<std::size_t>(chart.columns) * chart.rows, kUnknown)};
  for (const std::uint32_t t : triangles) {
    std::array<glm::dvec3, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = spatial::rotate_back(chart.X_OH, coarse.positions_O[coarse.triangles[t][k]] - chart.X_OH.p);
    }
    const glm::dvec2 e1(p[1] - p[0]), e2(p[2] - p[0]);
    const double det = e1.x * e2.y - e1.y * e2.x;
    if (!(det > 0)) continue;
    const glm::dvec3 low = glm::min(glm::min(p[0], p[1]), p[2]), high = glm::max(glm::max(p[0], p[1]), p[2]);
    const int i0 = static_cast<int>(std::floor(low.x / texel_m - 0.5)), i1 = static_cast<int>(high.x / texel_m);
    const int j0 = static_cast<int>(std::floor(low.y / texel_m - 0.5)), j1 = static_cast<int>(high.y / texel_m);
    for (int j = std::max(j0, 0); j <= std::min(j1, grid.rows - 1); ++j) {
      for (int i = std::max(i0, 0); i <= std::min(i1, grid.columns - 1); ++i) {
        const glm::dvec2 q = glm::dvec2((i + 0.5) * texel_m, (j + 0.5) * texel_m) - glm::dvec2(p[0]);
        const double u = (q.x * e2.y - q.y * e2.x) / det, v = (e1.x * q.y - e1.y * q.x) / det;
        constexpr double kSlack = 1e-9;
        if (u < -kSlack || v < -kSlack || u + v > 1 + kSlack) continue;
        grid.at(i, j) = p[0].z + u * (p[1].z - p[0].z) + v * (p[2].z - p[0].z);
      }
    }
  }
  return grid;
}

/// Forgets heights that no smooth surface over the coarse one can have: where neighbours differ by a cliff, a ray
/// passed an edge and met what lies behind it. Of two such neighbours the one further from the coarse surface goes.
/// One look is enough, whatever a stranger's file has: who may stay beside its neighbours may stay beside fewer of
/// them.
void forget_cliffs(Grid& grid, const Grid& coarse, double most_step_m) {
  const auto off_m = [&](int i, int j) { return std::abs(grid.at_or_unknown(i, j) - coarse.at_or_unknown(i, j)); };
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      for (const auto& [di, dj] : kSteps) {
        const double rise_m = (grid.at_or_unknown(i + di, j + dj) - coarse.at_or_unknown(i + di, j + dj)) -
                              (grid.at_or_unknown(i, j) - coarse.at_or_unknown(i, j));
        if (!(std::abs(rise_m) > most_step_m) || off_m(i, j) < off_m(i + di, j + dj)) continue;
        grid.at(i, j) = kUnknown;
        break;
      }
    }
  }
}

/// Every texel still unknown, from the known ones outwards, ring by ring, levelling off. What is made up stays within a
/// few texels of the known heights' range: slopes of two fronts that meet would otherwise feed each other.
void fill(Grid& grid, double texel_m) {
  constexpr double kBeyond = 4;  // texels
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const double z : grid.z) {
    if (!std::isnan(z))
      low_m = std::min(low_m, z - kBeyond * texel_m), high_m = std::max(high_m, z + kBeyond * texel_m);
  }
  std::deque<std::array<int, 2>> front;
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      if (!std::isnan(grid.at(i, j))) front.push_back({i, j});
    }
  }
  if (front.empty()) std::fill(grid.z.begin(), grid.z.end(), 0.0);
  while (!front.empty()) {
    const auto [i, j] = front.front();
    front.pop_front();
    for (const auto& [di, dj] : kSteps) {
      if (!grid.has(i + di, j + dj) || !std::isnan(grid.at(i + di, j + dj))) continue;
      constexpr double kStraightness = 0.5;  // a geometric series: the slope is used up after a few texels
      grid.at(i + di, j + dj) = std::clamp(continued(grid, i + di, j + dj, kStraightness), low_m, high_m);
      front.push_back({i + di, j + dj});
    }
  }
}

}  // namespace

ChartHeights chart_heights(const geometry::TriangleMesh& coarse, std::span<const std::uint32_t> triangles,
                           const geometry::Chart& chart, const HeightNear& height, double reach_m, int rays_across) {
  ChartHeights out;
  const double texel_m = chart.texel_m;
  const auto find = [&](int i, int j, double expected_m, double within_m) {
    double sum_m = 0;
    int hits = 0;
    for (int n = 0; n < rays_across * rays_across; ++n) {
      const double u = (n % rays_across + 0.5) / rays_across, v = (n / rays_across + 0.5) / rays_across;
      if (const auto z = height({(i + u) * texel_m, (j + v) * texel_m}, expected_m, within_m)) sum_m += *z, ++hits;
    }
    return hits == rays_across * rays_across ? expected_m + sum_m / hits : kUnknown;
  };

  constexpr double kSteepest = 2.5;  // change of height over one texel's step
  const Grid coarse_grid = coarse_heights(coarse, triangles, chart);
  Grid grid = coarse_grid;
  out.is_own.resize(grid.z.size());
  std::deque<std::array<int, 2>> front;
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      double& z = grid.at(i, j);
      if (std::isnan(z)) continue;
      out.is_own[static_cast<std::size_t>(j) * chart.columns + i] = true;
      ++out.own;
      z = find(i, j, z, reach_m);
    }
  }
  forget_cliffs(grid, coarse_grid, kSteepest * texel_m);
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      if (!out.is_own[static_cast<std::size_t>(j) * chart.columns + i]) continue;
      if (std::isnan(grid.at(i, j))) {
        ++out.missed;
      } else {
        front.push_back({i, j});
      }
    }
  }
  // Beyond the own triangles the surface is followed from texel to texel, never down a cliff.
  std::vector<bool> is_tried = out.is_own;
  while (!front.empty()) {
    const auto [i, j] = front.front();
    front.pop_front();
    for (const auto& [di, dj] : kSteps) {
      const int a = i + di, b = j + dj;
      if (!grid.has(a, b)) continue;
      const std::size_t index = static_cast<std::size_t>(b) * chart.columns + a;
      if (is_tried[index]) continue;
      is_tried[index] = true;
      grid.at(a, b) = find(a, b, continued(grid, a, b, 0.5), kSteepest * texel_m);
      if (!std::isnan(grid.at(a, b))) front.push_back({a, b});
    }
  }
  fill(grid, texel_m);
  out.heights = {.X_OH = chart.X_OH,
                 .texel_m = texel_m,
                 .columns = chart.columns,
                 .rows = chart.rows,
                 .heights_m = std::move(grid.z),
                 .are_means = rays_across > 1};
  return out;
}

}  // namespace farfeel::codecs
