// A uniform quadratic B-spline on unit cells centred at the texels. With x in [-1/2, 1/2] measured from a texel's
// centre the three weights are  (1/2 - x)^2 / 2,  3/4 - x^2,  (1/2 + x)^2 / 2;  they sum to one, and value and slope
// agree with the neighbouring texel's at x = +-1/2.
#include "haptic_core/geometry/haptic_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace farfeel::geometry {
namespace {

struct Spline {
  std::array<double, 3> weight, slope, curvature;  // slope per texel, curvature per texel squared
};

Spline spline_at(double x) {
  const double a = 0.5 - x, b = 0.5 + x;
  return {{0.5 * a * a, 0.75 - x * x, 0.5 * b * b}, {-a, -2 * x, b}, {1, -2, 1}};
}

double combine(const std::array<std::array<double, 3>, 3>& c, const std::array<double, 3>& along_s,
               const std::array<double, 3>& along_t) {
  double sum = 0;
  for (std::size_t j = 0; j < 3; ++j) {
    sum += along_t[j] * (c[j][0] * along_s[0] + c[j][1] * along_s[1] + c[j][2] * along_s[2]);
  }
  return sum;
}

}  // namespace

HeightSample sample_height(const HapticSurface& surface, const Chart& chart, double s_m, double t_m) noexcept {
  const double s = std::clamp(s_m / chart.texel_m, 0.0, static_cast<double>(chart.columns));
  const double t = std::clamp(t_m / chart.texel_m, 0.0, static_cast<double>(chart.rows));
  const std::uint32_t i = std::min(static_cast<std::uint32_t>(s), chart.columns - 1);
  const std::uint32_t j = std::min(static_cast<std::uint32_t>(t), chart.rows - 1);
  const HeightTile& tile = surface.tiles[chart.first_tile + (j / kTileTexels) * chart.tiles_across() + i / kTileTexels];
  const std::size_t column = i % kTileTexels, row = j % kTileTexels;  // of the first coefficient of three

  std::array<std::array<double, 3>, 3> c;
  for (std::size_t b = 0; b < 3; ++b) {
    for (std::size_t a = 0; a < 3; ++a) c[b][a] = surface.scale.height_m(tile.at(column + a, row + b));
  }
  const Spline u = spline_at(s - (i + 0.5)), v = spline_at(t - (j + 0.5));
  const double per_texel = 1.0 / chart.texel_m;
  return {.h_m = combine(c, u.weight, v.weight),
          .h_s = combine(c, u.slope, v.weight) * per_texel,
          .h_t = combine(c, u.weight, v.slope) * per_texel,
          .h_ss_1_per_m = combine(c, u.curvature, v.weight) * per_texel * per_texel,
          .h_st_1_per_m = combine(c, u.slope, v.slope) * per_texel * per_texel,
          .h_tt_1_per_m = combine(c, u.weight, v.curvature) * per_texel * per_texel};
}

std::vector<std::string> faults(const HapticSurface& surface) {
  std::vector<std::string> found;
  const TriangleMesh& coarse = surface.coarse;
  for (std::size_t i = 0; i < coarse.positions_O.size(); ++i) {
    if (!spatial::is_finite(coarse.positions_O[i])) found.push_back(fmt::format("coarse vertex {} is not finite", i));
  }
  const std::size_t triangles = coarse.triangles.size();
  if (surface.triangle_piece.size() != triangles || surface.triangle_chart.size() != triangles) {
    found.push_back(fmt::format("{} coarse triangles, but {} piece and {} chart entries", triangles,
                                surface.triangle_piece.size(), surface.triangle_chart.size()));
    return found;
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    for (const std::uint32_t v : coarse.triangles[i]) {
      if (v >= coarse.positions_O.size()) found.push_back(fmt::format("coarse triangle {} names vertex {}", i, v));
    }
    if (surface.triangle_piece[i] >= surface.piece_count) {
      found.push_back(
          fmt::format("triangle {} is in piece {} of {}", i, surface.triangle_piece[i], surface.piece_count));
    }
    if (surface.triangle_chart[i] != kNoChart && surface.triangle_chart[i] >= surface.charts.size()) {
      found.push_back(
          fmt::format("triangle {} is in chart {} of {}", i, surface.triangle_chart[i], surface.charts.size()));
    }
  }
  for (std::size_t i = 0; i < surface.charts.size(); ++i) {
    const Chart& chart = surface.charts[i];
    if (!spatial::is_valid(chart.X_OH) || !(chart.texel_m > 0) || chart.columns == 0 || chart.rows == 0) {
      found.push_back(fmt::format("chart {} has no valid frame, texel or size", i));
      continue;
    }
    const std::uint64_t end = chart.first_tile + static_cast<std::uint64_t>(chart.tiles_across()) * chart.tiles_down();
    if (end > surface.tiles.size())
      found.push_back(fmt::format("chart {} needs tiles up to {}, {} exist", i, end, surface.tiles.size()));
  }
  if (!std::isfinite(surface.scale.offset_m) || !(surface.scale.scale_m > 0)) {
    found.push_back("the height scale is not finite and positive");
  }
  return found;
}

}  // namespace farfeel::geometry
