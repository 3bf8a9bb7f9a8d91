// Each patch is cut into small triangles, flat ones, which are drawn over the chart row by row: at every texel's centre
// all heights that face up. Of these the one nearest to the coarse mesh is felt (chart_heights.h).
#include "codecs/asset/followed_heights.h"

#include <algorithm>
#include <cmath>

#include "codecs/asset/chart_frame.h"
#include "codecs/asset/curved_mesh.h"

namespace farfeel::codecs {
namespace {

using geometry::Chart;
using geometry::HapticSurface;

constexpr std::uint64_t kMostPairs = 1U << 30;     // of a chart and a triangle
constexpr std::uint64_t kMostLooks = 1U << 28;     // rows and texels of small triangles
constexpr std::size_t kMostHeights = 1U << 24;     // over one chart
constexpr double kMostTexelsAway = 1 << 20;        // from a chart's corner to its own triangles
constexpr double kFacesUp = 0.2588;                // cosine of 75 degrees
constexpr double kMostParts = 6, kPartTexels = 2;  // along a patch's side

/// Heights over a chart's plane at texels' centres, several where the surface lies above itself.
class Layers {
 public:
  Layers(const Chart& chart, std::uint64_t& looks) : chart_(chart), looks_(looks) {}

  /// Corners in the chart's frame. False where there is too much.
  [[nodiscard]] bool draw(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 n = glm::cross(b - a, c - a);
    if (!(n.z > kFacesUp * glm::length(n))) return true;
    const double h = chart_.texel_m;
    const std::array<glm::dvec2, 3> p{glm::dvec2(a) / h - 0.5, glm::dvec2(b) / h - 0.5, glm::dvec2(c) / h - 0.5};
    const double low = std::min({p[0].y, p[1].y, p[2].y}), high = std::max({p[0].y, p[1].y, p[2].y});
    const int first = whole(std::ceil(low - kSlack), chart_.rows), last = whole(std::floor(high + kSlack), chart_.rows);
    for (int row = std::max(0, first); row <= std::min(last, static_cast<int>(chart_.rows) - 1); ++row) {
      const auto [from, to] = columns_of(p, row);
      const int end = std::min(to, static_cast<int>(chart_.columns) - 1);
      looks_ += 1 + static_cast<std::uint64_t>(std::max(0, end - std::max(0, from) + 1));
      if (looks_ > kMostLooks || heights_.size() > kMostHeights) return false;
      for (int column = std::max(0, from); column <= end; ++column) {
        const double z = a.z - h * (n.x * (column - p[0].x) + n.y * (row - p[0].y)) / n.z;
        heights_.push_back({static_cast<std::uint32_t>(row) * chart_.columns + static_cast<std::uint32_t>(column), z});
      }
    }
    return true;
  }
  void close() {
    std::sort(heights_.begin(), heights_.end(),
              [](const Height& x, const Height& y) { return std::pair(x.texel, x.z_m) < std::pair(y.texel, y.z_m); });
  }
  [[nodiscard]] std::optional<double> near(const glm::dvec2& at_m, double near_m, double reach_m) const {
    const auto column = static_cast<std::uint32_t>(at_m.x / chart_.texel_m),
               row = static_cast<std::uint32_t>(at_m.y / chart_.texel_m), texel = row * chart_.columns + column;
    std::optional<double> best;
    for (auto it = std::lower_bound(heights_.begin(), heights_.end(), texel,
                                    [](const Height&x, std::uint32_t of) { return x.texel < of; });
         it != heights_.end() && it->texel == texel; ++it) {
      const double off = it->z_m - near_m;
      if (std::abs(off) <= reach_m && (!best || std::abs(off) < std::abs(*best))) best = off;
    }
    return best;
  }

 private:
  struct Height {
    std::uint32_t texel;
    double z_m;
  };
  static constexpr double kSlack = 1e-9;  // of a texel: what lies on an edge belongs to both sides

  /// Within a texel of the chart; -1 of what is no number.
  static int whole(double value, std::uint32_t most) {
    return value > -1 ? static_cast<int>(std::min(value, static_cast<double>(most))) : -1;
  }
  /// Between the three sides, which turn left round the triangle; empty where the second is less.
  [[nodiscard]] std::pair<int, int> columns_of(const std::array<glm::dvec2, 3>& p, int row) const {
    double low = -1, high = chart_.columns;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec2 &from = p[k], way = p[(k + 1) % 3] - from;
      const double up = row - from.y;
      if (way.y == 0) continue;  // the row is within the triangle's
      const double x = from.x + way.x * up / way.y;
      (way.y > 0 ? high : low) = way.y > 0 ? std::min(high, x) : std::max(low, x);
    }
    return {whole(std::ceil(low - kSlack), chart_.columns), whole(std::floor(high + kSlack), chart_.columns)};
  }

  const Chart& chart_;
  std::uint64_t& looks_;
  std::vector<Height> heights_;
};

double mean_side_m(const geometry::TriangleMesh& mesh) {
  double sum_m = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) sum_m += glm::length(mesh.positions_O[t[k]] - mesh.positions_O[t[(k + 1) % 3]]);
  }
  return sum_m / (3 * static_cast<double>(mesh.triangles.size()));
}

class Following {
 public:
  Following(const HapticSurface& surface, std::uint32_t charts, const FeltDetail& detail)
      : surface_(surface),
        detail_(detail),
        curved_(detail.mesh),
        side_m_(mean_side_m(detail.mesh)),
        triangles_(charts) {
    for (std::uint32_t t = 0; t < surface.triangle_chart.size(); ++t) {
      if (surface.triangle_chart[t] != geometry::kNoChart) triangles_[surface.triangle_chart[t]].push_back(t);
    }
  }

  [[nodiscard]] std::optional<ChartHeights> chart(std::size_t index) {
    if (triangles_[index].empty() || !(detail_.texel_m > 0)) return std::nullopt;
    const ChartFrame frame = chart_frame(surface_.coarse, triangles_[index]);
    const glm::dvec2 sides = frame.patch_size_m / detail_.texel_m;
    if (!(std::max(sides.x, sides.y) <= kMostTexelsAway)) return std::nullopt;
    const Chart chart = placed_chart(frame, detail_.texel_m);
    texels_ += std::uint64_t{chart.columns} * chart.rows;
    if (texels_ > kMostFollowedTexels || !is_within(chart, triangles_[index])) return std::nullopt;
    Layers layers(chart, looks_);
    const glm::dvec2 size_m = chart.texel_m * glm::dvec2(chart.columns, chart.rows);
    const int parts = static_cast<int>(std::clamp(std::ceil(side_m_ / (kPartTexels * chart.texel_m)), 1.0, kMostParts));
    for (std::size_t t = 0; t < curved_.size(); ++t) {
      const glm::dvec3 middle = in_chart(chart, curved_.middle(t));
      const double radius_m = curved_.radius_m(t);
      if (!(middle.x > -radius_m && middle.y > -radius_m && middle.x < size_m.x + radius_m &&
            middle.y < size_m.y + radius_m))
        continue;
      if (!draw(chart, t, parts, layers)) return std::nullopt;
    }
    layers.close();
    const auto near = [&layers](const glm::dvec2& at_m, double near_m, double reach_m) {
      return layers.near(at_m, near_m, reach_m);
    };
    return chart_heights(surface_.coarse, triangles_[index], chart, near, detail_.reach_m, 1);
  }

 private:
  static glm::dvec3 in_chart(const Chart& chart, const glm::dvec3& p_O) {
    return spatial::rotate_back(chart.X_OH, p_O - chart.X_OH.p);
  }
  /// Its own triangles are about where it is, and cover no more than can be looked at.
  [[nodiscard]] bool is_within(const Chart& chart, const std::vector<std::uint32_t>& triangles) {
    for (const std::uint32_t i : triangles) {
      glm::dvec2 low(kMostTexelsAway), high(-kMostTexelsAway);
      for (const std::uint32_t v : surface_.coarse.triangles[i]) {
        const glm::dvec3 p = in_chart(chart, surface_.coarse.positions_O[v]) / chart.texel_m;
        for (int axis = 0; axis < 3; ++axis) {
          if (!(std::abs(p[axis]) <= kMostTexelsAway)) return false;
        }
        low = glm::min(low, glm::dvec2(p)), high = glm::max(high, glm::dvec2(p));
      }
      const glm::dvec2 texels = glm::min(high - low + 2.0, glm::dvec2(chart.columns, chart.rows));
      looks_ += static_cast<std::uint64_t>(texels.x * texels.y);
      if (looks_ > kMostLooks) return false;
    }
    return true;
  }
  [[nodiscard]] bool draw(const Chart& chart, std::size_t t, int parts, Layers& layers) const {
    const auto corner = [&](int i, int j) {
      const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
      return in_chart(chart, curved_.point(t, {1 - u - v, u, v}));
    };
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        const glm::dvec3 a = corner(i + 1, j), b = corner(i, j + 1);
        if (!layers.draw(corner(i, j), a, b)) return false;
        if (i + j + 1 < parts && !layers.draw(a, corner(i + 1, j + 1), b)) return false;
      }
    }
    return true;
  }

  const HapticSurface& surface_;
  const FeltDetail& detail_;
  CurvedMesh curved_;
  double side_m_;
  std::vector<std::vector<std::uint32_t>> triangles_;
  std::uint64_t looks_ = 0, texels_ = 0;
};

}  // namespace

std::optional<std::vector<ChartHeights>> follow(HapticSurface& surface, std::uint32_t chart_count,
                                                const FeltDetail& detail) {
  if (chart_count * std::uint64_t{detail.mesh.triangles.size()} > kMostPairs) return std::nullopt;
  Following following(surface, chart_count, detail);
  std::vector<ChartHeights> charts;
  for (std::size_t i = 0; i < chart_count; ++i) {
    auto chart = following.chart(i);
    if (!chart) return std::nullopt;
    charts.push_back(*std::move(chart));
  }
  std::vector<geometry::SampledChart> sampled;
  for (const ChartHeights& chart : charts) sampled.push_back(chart.heights);
  geometry::set_height_fields(surface, sampled);
  return charts;
}

}  // namespace farfeel::codecs
