#include "tests/support/plates.h"

#include <cmath>

#include "haptic_core/geometry/height_field_fit.h"

namespace farfeel::support {

using geometry::HapticSurface;

HapticSurface flat_plate(const PlateSize& size) {
  const double x = 0.5 * size.width_m, y = 0.5 * size.depth_m;
  HapticSurface plate;
  plate.coarse.positions_O = {{-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}};
  plate.coarse.triangles = {{0, 1, 2}, {0, 2, 3}};
  plate.triangle_piece = {0, 0};
  plate.triangle_chart = {geometry::kNoChart, geometry::kNoChart};
  plate.piece_count = 1;
  return plate;
}

HapticSurface textured_plate(const PlateSize& size, const std::function<double(double, double)>& height_m) {
  HapticSurface plate = flat_plate(size);
  plate.triangle_chart = {0, 0};
  geometry::SampledChart chart{};
  chart.texel_m = size.texel_m;
  chart.columns = static_cast<std::uint32_t>(std::ceil((size.width_m + 2 * size.margin_m) / size.texel_m));
  chart.rows = static_cast<std::uint32_t>(std::ceil((size.depth_m + 2 * size.margin_m) / size.texel_m));
  chart.X_OH.p = {-0.5 * chart.columns * chart.texel_m, -0.5 * chart.rows * chart.texel_m, 0};
  for (std::uint32_t j = 0; j < chart.rows; ++j) {
    for (std::uint32_t i = 0; i < chart.columns; ++i) {
      chart.heights_m.push_back(
          height_m(chart.X_OH.p.x + (i + 0.5) * chart.texel_m, chart.X_OH.p.y + (j + 0.5) * chart.texel_m));
    }
  }
  geometry::set_height_fields(plate, {&chart, 1});
  return plate;
}

HapticSurface stacked(const HapticSurface& first, const HapticSurface& second, const glm::dvec3& offset) {
  HapticSurface both = first;
  const auto vertices = static_cast<std::uint32_t>(first.coarse.positions_O.size());
  const auto charts = static_cast<std::uint32_t>(first.charts.size());
  for (const glm::dvec3& p : second.coarse.positions_O) both.coarse.positions_O.push_back(p + offset);
  for (const geometry::Triangle& t : second.coarse.triangles) {
    both.coarse.triangles.push_back({t[0] + vertices, t[1] + vertices, t[2] + vertices});
  }
  for (const std::uint32_t piece : second.triangle_piece) both.triangle_piece.push_back(piece + first.piece_count);
  for (const std::uint32_t chart : second.triangle_chart) {
    both.triangle_chart.push_back(chart == geometry::kNoChart ? chart : chart + charts);
  }
  for (geometry::Chart chart : second.charts) {
    chart.first_tile += static_cast<std::uint32_t>(first.tiles.size());
    chart.X_OH.p += offset;
    both.charts.push_back(chart);
  }
  both.tiles.insert(both.tiles.end(), second.tiles.begin(), second.tiles.end());
  both.piece_count += second.piece_count;
  return both;
}

}  // namespace farfeel::support
