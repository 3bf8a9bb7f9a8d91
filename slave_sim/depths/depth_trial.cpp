#include "slave_sim/depths/depth_trial.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "haptic_core/geometry/height_field_fit.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kWidth_m = 0.012, kTexel_m = 50e-6, kDepth_m = 0.15e-3, kStep_m = 10e-6;

/// Two coarse triangles with ridges over them.
geometry::HapticSurface ridged_plate(double period_m, double height_m) {
  const double half = 0.5 * kWidth_m;
  geometry::HapticSurface plate;
  plate.coarse.positions_O = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  plate.coarse.triangles = {{0, 1, 2}, {0, 2, 3}};
  plate.triangle_piece = {0, 0};
  plate.triangle_chart = {0, 0};
  plate.piece_count = 1;
  geometry::SampledChart chart{};
  chart.texel_m = kTexel_m;
  chart.columns = chart.rows = static_cast<std::uint32_t>(kWidth_m / kTexel_m);
  chart.X_OH.p = {-half, -half, 0};
  for (std::uint32_t j = 0; j < chart.rows; ++j) {
    for (std::uint32_t i = 0; i < chart.columns; ++i)
      chart.heights_m.push_back(0.5 * height_m * std::cos(2 * std::numbers::pi * i * kTexel_m / period_m));
  }
  geometry::set_height_fields(plate, {&chart, 1});
  return plate;
}

}  // namespace

double trial_us(penetration::BackEnd& back_end, std::size_t frames) {
  const geometry::HapticSurface s_surface = ridged_plate(3.7e-3, 0.3e-3), t_surface = ridged_plate(4.2e-3, 0.3e-3);
  const penetration::FeltSurface s(s_surface), t(t_surface);
  back_end.prepare(s);
  back_end.prepare(t);
  const std::vector<std::uint32_t> both{0, 1};
  std::array<penetration::Query, 7> queries;
  std::array<penetration::Penetration, 7> answers;
  std::vector<double> us;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const double along_m = 1e-3 * static_cast<double>(i) + kStep_m * static_cast<double>(frame % 100);
      const glm::dquat turned = spatial::rotation_from_vector({0.01, 0.005, 0.5 * static_cast<double>(i)});
      queries[i] = {.s = {&s, {}, both},
                    .t = {&t, {turned * glm::dquat{0, 1, 0, 0}, {along_m - 3e-3, 0.3 * along_m, -kDepth_m}}, both},
                    .window = {{-4e-3, -4e-3}, {4e-3, 4e-3}}};
    }
    const auto began = std::chrono::steady_clock::now();
    back_end.evaluate(queries, answers);
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - began).count());
  }
  std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(us.size() / 2), us.end());
  return us[us.size() / 2];
}

}  // namespace farfeel::slave_sim
