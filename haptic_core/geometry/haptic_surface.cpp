// A uniform quadratic B-spline on unit cells centred at the texels. With x in [-1/2, 1/2] measured from a texel's
// centre the three weights are  (1/2 - x)^2 / 2,  3/4 - x^2,  (1/2 + x)^2 / 2;  they sum to one, and value and slope
// agree with the neighbouring texel's at x = +-1/2. Collected by powers of x, coefficients c0, c1, c2 give
//   (c0 + 6 c1 + c2) / 8  +  x (c2 - c0) / 2  +  x^2 (c0 - 2 c1 + c2) / 2.
#include "haptic_core/geometry/haptic_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace farfeel::geometry {
namespace {

constexpr double kMostOfSize = 1 + 1e-6;  ///< that a thickness may be, which is rounded to float

/// The spline within one texel, along one axis.
struct Parabola {
  double k0, k1, k2;

  static Parabola of(double c0, double c1, double c2) {
    return {0.125 * (c0 + 6 * c1 + c2), 0.5 * (c2 - c0), 0.5 * (c0 - 2 * c1 + c2)};
  }
  [[nodiscard]] double value(double x) const { return k0 + x * (k1 + x * k2); }
  [[nodiscard]] double slope(double x) const { return k1 + 2 * x * k2; }
  [[nodiscard]] double curvature() const { return 2 * k2; }
};

}  // namespace

HeightSample sample_height(const HapticSurface& surface, const Chart& chart, double s_m, double t_m) noexcept {
  const double per_texel = 1.0 / chart.texel_m;
  const double s = std::clamp(s_m * per_texel, 0.0, static_cast<double>(chart.columns));
  const double t = std::clamp(t_m * per_texel, 0.0, static_cast<double>(chart.rows));
  const std::uint32_t i = std::min(static_cast<std::uint32_t>(s), chart.columns - 1);
  const std::uint32_t j = std::min(static_cast<std::uint32_t>(t), chart.rows - 1);
  const HeightTile& tile = surface.tiles[chart.first_tile + (j / kTileTexels) * chart.tiles_across() + i / kTileTexels];
  const std::uint16_t* c = &tile.coefficients[(j % kTileTexels) * kTileSide + i % kTileTexels];  // the first of 3 x 3

  const double x = s - (i + 0.5), y = t - (j + 0.5);
  std::array<double, 3> value, slope, curvature;  // of each row along s
  for (std::size_t row = 0; row < 3; ++row, c += kTileSide) {
    const Parabola along_s = Parabola::of(c[0], c[1], c[2]);
    value[row] = along_s.value(x);
    slope[row] = along_s.slope(x);
    curvature[row] = along_s.curvature();
  }
  const Parabola h = Parabola::of(value[0], value[1], value[2]);
  const Parabola h_s = Parabola::of(slope[0], slope[1], slope[2]);
  const Parabola h_ss = Parabola::of(curvature[0], curvature[1], curvature[2]);
  const double slope_scale = surface.scale.scale_m * per_texel, curvature_scale = slope_scale * per_texel;
  return {.h_m = surface.scale.offset_m + surface.scale.scale_m * h.value(y),
          .h_s = h_s.value(y) * slope_scale,
          .h_t = h.slope(y) * slope_scale,
          .h_ss_1_per_m = h_ss.value(y) * curvature_scale,
          .h_st_1_per_m = h_s.slope(y) * curvature_scale,
          .h_tt_1_per_m = h.curvature() * curvature_scale};
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
  const std::vector<double>& thickness_m = surface.piece_thickness_m;
  if (!thickness_m.empty() && thickness_m.size() != surface.piece_count)
    found.push_back(fmt::format("{} pieces, but {} thicknesses", surface.piece_count, thickness_m.size()));
  const double size_m = coarse.positions_O.empty() ? 0 : glm::length(bounding_box(coarse).size());
  for (std::size_t i = 0; i < thickness_m.size(); ++i) {
    if (!(thickness_m[i] >= 0 && thickness_m[i] <= kMostOfSize * size_m))
      found.push_back(fmt::format("piece {} is {} m thick, and the whole {} m large", i, thickness_m[i], size_m));
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
