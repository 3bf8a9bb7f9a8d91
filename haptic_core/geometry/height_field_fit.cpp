// At a texel's centre the quadratic B-spline weighs its neighbours 1/8, 3/4, 1/8 along either axis, so interpolation
// solves, along every row and then every column,
//   (c[i-1] + 6 c[i] + c[i+1]) / 8 = f[i],   0 <= i < n,   with c[-1] = 2 c[0] - c[1] and c[n] = 2 c[n-1] - c[n-2],
// the straight continuation, which makes c[0] = f[0] and c[n-1] = f[n-1]. The system is tridiagonal and diagonally
// dominant: elimination without pivoting is stable. Source: Unser, Splines: a perfect fit, IEEE SPM 16(6), 1999.
// A mean over a texel weighs them 1/6, 2/3, 1/6 (the cubic B-spline's values: a box convolved with the quadratic one),
// so that means are reproduced the same way with 4 and 6 in place of 6 and 8, without the loss that averaging alone
// brings.
#include "haptic_core/geometry/height_field_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace farfeel::geometry {
namespace {

/// In place on n values at `stride`; `scratch` holds at least n. The middle coefficient weighs `middle` times as much
/// as either neighbour: 6 for values at centres, 4 for means.
void interpolate(double* f, std::size_t n, std::size_t stride, double middle, std::vector<double>& scratch) {
  if (n < 3) return;
  // Inner unknowns 1..n-2: c[i-1] + m c[i] + c[i+1] = (m + 2) f[i], ends known.
  double above = 0;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double pivot = middle - above;
    const double before = f[(i - 1) * stride];
    f[i * stride] = ((middle + 2) * f[i * stride] - before) / pivot;
    scratch[i] = above = 1 / pivot;
  }
  for (std::size_t i = n - 2; i >= 1; --i) f[i * stride] -= scratch[i] * f[(i + 1) * stride];
}

/// Coefficients with a border of one: (columns + 2) x (rows + 2).
struct Coefficients {
  std::size_t across, down;
  std::vector<double> c;

  double& at(std::size_t i, std::size_t j) { return c[j * across + i]; }
};

Coefficients coefficients_of(const SampledChart& chart) {
  const std::size_t columns = chart.columns, rows = chart.rows;
  std::vector<double> f = chart.heights_m, scratch(std::max(columns, rows));
  const double middle = chart.are_means ? 4 : 6;
  for (std::size_t j = 0; j < rows; ++j) interpolate(&f[j * columns], columns, 1, middle, scratch);
  for (std::size_t i = 0; i < columns; ++i) interpolate(&f[i], rows, columns, middle, scratch);

  Coefficients out{columns + 2, rows + 2, std::vector<double>((columns + 2) * (rows + 2))};
  for (std::size_t j = 0; j < rows; ++j) {
    std::copy_n(&f[j * columns], columns, &out.at(1, j + 1));
  }
  const auto straight = [](double inner, double next) { return 2 * inner - next; };
  for (std::size_t j = 1; j <= rows; ++j) {
    out.at(0, j) = columns > 1 ? straight(out.at(1, j), out.at(2, j)) : out.at(1, j);
    out.at(columns + 1, j) = columns > 1 ? straight(out.at(columns, j), out.at(columns - 1, j)) : out.at(1, j);
  }
  for (std::size_t i = 0; i < out.across; ++i) {
    out.at(i, 0) = rows > 1 ? straight(out.at(i, 1), out.at(i, 2)) : out.at(i, 1);
    out.at(i, rows + 1) = rows > 1 ? straight(out.at(i, rows), out.at(i, rows - 1)) : out.at(i, 1);
  }
  return out;
}

}  // namespace

void set_height_fields(HapticSurface& surface, std::span<const SampledChart> sampled) {
  std::vector<Coefficients> fields;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const SampledChart& chart : sampled) {
    assert(chart.heights_m.size() == static_cast<std::size_t>(chart.columns) * chart.rows);
    fields.push_back(coefficients_of(chart));
    const auto [least, most] = std::minmax_element(fields.back().c.begin(), fields.back().c.end());
    low = std::min(low, *least), high = std::max(high, *most);
  }
  constexpr double kLeastScale_m = 1e-9;  // a flat surface needs some scale
  surface.scale = {.offset_m = sampled.empty() ? 0 : low, .scale_m = std::max(kLeastScale_m, (high - low) / 65535)};
  surface.charts.clear();
  surface.tiles.clear();
  for (std::size_t n = 0; n < sampled.size(); ++n) {
    Chart chart{.X_OH = sampled[n].X_OH,
                .texel_m = sampled[n].texel_m,
                .columns = sampled[n].columns,
                .rows = sampled[n].rows,
                .first_tile = static_cast<std::uint32_t>(surface.tiles.size())};
    Coefficients& field = fields[n];
    for (std::size_t tj = 0; tj < chart.tiles_down(); ++tj) {
      for (std::size_t ti = 0; ti < chart.tiles_across(); ++ti) {
        HeightTile& tile = surface.tiles.emplace_back();
        for (std::size_t j = 0; j < kTileSide; ++j) {
          for (std::size_t i = 0; i < kTileSide; ++i) {
            const double c = field.at(std::min(ti * kTileTexels + i, field.across - 1),
                                      std::min(tj * kTileTexels + j, field.down - 1));
            const double steps = std::round((c - surface.scale.offset_m) / surface.scale.scale_m);
            tile.coefficients[j * kTileSide + i] = static_cast<std::uint16_t>(std::clamp(steps, 0.0, 65535.0));
          }
        }
      }
    }
    surface.charts.push_back(chart);
  }
}

}  // namespace farfeel::geometry
