#include "slave_sim/models/height_plate.h"

#include <cmath>
#include <numbers>

#include "haptic_core/geometry/height_field_fit.h"
#include "slave_sim/models/lattice_solid.h"

namespace farfeel::slave_sim {

geometry::HapticSurface height_plate(const std::function<double(double, double)>& height_m, const PlateSize& plate) {
  const LatticeSolid box{.cuts_m = {{{-0.5, 0.5}, {-0.5, 0.5}, {-1, 0}}},
                         .steps = {{{1}, {1}, {1}}},
                         .is_solid = [](int, int, int) { return true; }};
  geometry::HapticSurface surface;
  surface.coarse = skin(box, [&](const LatticePoint& at) { return geometry::rounded_to_float(at.p * plate.size_m); });
  surface.piece_count = 1;
  for (const geometry::Triangle& t : surface.coarse.triangles) {
    surface.triangle_piece.push_back(0);
    surface.triangle_chart.push_back(geometry::unit_normal(surface.coarse, t).z > 0.5 ? 0 : geometry::kNoChart);
  }

  constexpr std::uint32_t kMargin = 4;  // texels beyond the face on every side
  const auto across = [&](double length_m) {
    return static_cast<std::uint32_t>(std::ceil(length_m / plate.texel_m)) + 2 * kMargin;
  };
  geometry::SampledChart chart{.X_OH = {},
                               .texel_m = plate.texel_m,
                               .columns = across(plate.size_m.x),
                               .rows = across(plate.size_m.y),
                               .heights_m = {}};
  chart.X_OH.p = {-0.5 * chart.columns * plate.texel_m, -0.5 * chart.rows * plate.texel_m, 0};
  for (std::uint32_t j = 0; j < chart.rows; ++j) {
    for (std::uint32_t i = 0; i < chart.columns; ++i) {
      chart.heights_m.push_back(
          height_m(chart.X_OH.p.x + (i + 0.5) * plate.texel_m, chart.X_OH.p.y + (j + 0.5) * plate.texel_m));
    }
  }
  geometry::set_height_fields(surface, {&chart, 1});
  return surface;
}

geometry::HapticSurface ridged_plate(double period_m, double depth_m, const PlateSize& plate) {
  return height_plate(
      [=](double x_m, double) { return 0.5 * depth_m * (std::cos(2 * std::numbers::pi * x_m / period_m) - 1); }, plate);
}

}  // namespace farfeel::slave_sim
