#include "slave_sim/bake/few_bytes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "codecs/asset/felt_stream.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Chart;
using geometry::HapticSurface;
using geometry::kTileSide;
using geometry::kTileTexels;
using geometry::TriangleMesh;

constexpr double kMostStep_m = 1.0 / (1 << 14);  // 61 um: a vertex moves by 53 at most, half of what thin walls allow
constexpr double kStepsAcross = 2048;
constexpr int kHalvings = 6;
constexpr double kStepsOfTexel = 4;
constexpr int kKeptAround = 2;  // texels: one for the spline, one for what is met askew beyond an edge

double power_of_two_within(double most) {
  return std::exp2(std::floor(std::log2(most)));
}

/// Every triangle looks about where it did.
bool keeps_its_sides(const TriangleMesh& before, const TriangleMesh& after) {
  return std::all_of(before.triangles.begin(), before.triangles.end(), [&](const geometry::Triangle& t) {
    const glm::dvec3 was = geometry::unit_normal(before, t), is = geometry::unit_normal(after, t);
    return was == glm::dvec3(0) || glm::dot(was, is) > 0.5;
  });
}

/// A chart's coefficients as one field, with a border of one around the texels.
class Field {
 public:
  Field(HapticSurface& surface, const Chart& chart)
      : surface_(surface), chart_(chart), columns_(chart.columns + 2), rows_(chart.rows + 2), c_(columns_ * rows_) {
    for (std::size_t row = 0; row < rows_; ++row) {
      for (std::size_t column = 0; column < columns_; ++column) {
        const std::size_t across = std::min<std::size_t>(column / kTileTexels, chart.tiles_across() - 1),
                          down = std::min<std::size_t>(row / kTileTexels, chart.tiles_down() - 1);
        at(column, row) = tile(across, down).at(column - across * kTileTexels, row - down * kTileTexels);
      }
    }
  }

  /// Row by row, what is not kept becomes the median of the left, the upper, and both less the upper left; before a
  /// row's first that is kept, that; and so in the rows before the first with any.
  void level(const std::vector<bool>& is_kept) {
    const auto first_kept = [&](std::size_t row) {
      std::size_t column = 0;
      while (column < columns_ && !is_kept[row * columns_ + column]) ++column;
      return column;
    };
    std::size_t first_row = 0;
    while (first_row < rows_ && first_kept(first_row) == columns_) ++first_row;
    if (first_row == rows_) return std::fill(c_.begin(), c_.end(), c_[0]);
    std::fill(c_.begin(), c_.begin() + static_cast<std::ptrdiff_t>(first_row * columns_),
              at(first_kept(first_row), first_row));
    for (std::size_t row = first_row; row < rows_; ++row) {
      const std::size_t first = first_kept(row);
      const std::uint16_t before = first < columns_ ? at(first, row) : at(0, row - 1);
      for (std::size_t column = 0; column < columns_; ++column) {
        if (is_kept[row * columns_ + column]) continue;
        if (column == 0 || (first < columns_ && column < first)) {
          at(column, row) = before;
        } else if (row == 0) {
          at(column, row) = at(column - 1, row);
        } else {
          const int a = at(column - 1, row), b = at(column, row - 1), c = at(column - 1, row - 1);
          at(column, row) = static_cast<std::uint16_t>(std::clamp(a + b - c, std::min(a, b), std::max(a, b)));
        }
      }
    }
  }

  void put_back() {
    for (std::size_t down = 0; down < chart_.tiles_down(); ++down) {
      for (std::size_t across = 0; across < chart_.tiles_across(); ++across) {
        for (std::size_t n = 0; n < std::size_t{kTileSide} * kTileSide; ++n)
          tile(across, down).coefficients[n] = at(std::min(across * kTileTexels + n % kTileSide, columns_ - 1),
                                                  std::min(down * kTileTexels + n / kTileSide, rows_ - 1));
      }
    }
  }

 private:
  geometry::HeightTile& tile(std::size_t across, std::size_t down) {
    return surface_.tiles[chart_.first_tile + down * chart_.tiles_across() + across];
  }
  std::uint16_t& at(std::size_t column, std::size_t row) { return c_[row * columns_ + column]; }

  HapticSurface& surface_;
  const Chart& chart_;
  std::size_t columns_, rows_;
  std::vector<std::uint16_t> c_;
};

/// The texels that a chart's triangles reach into: those whose centres they cover, and those along their sides.
std::vector<bool> touched_texels(const HapticSurface& surface, const Chart& chart,
                                 const std::vector<std::uint32_t>& triangles, std::vector<bool> is_touched) {
  constexpr double kStepsPerTexel = 4;
  for (const std::uint32_t i : triangles) {
    const geometry::Triangle& t = surface.coarse.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto in_texels = [&](std::uint32_t v) {
        return glm::dvec2(spatial::rotate_back(chart.X_OH, surface.coarse.positions_O[v] - chart.X_OH.p)) /
               chart.texel_m;
      };
      const glm::dvec2 from = in_texels(t[k]), to = in_texels(t[(k + 1) % 3]);
      const int steps = static_cast<int>(std::ceil(kStepsPerTexel * glm::length(to - from)));
      for (int n = 0; n <= steps; ++n) {
        const glm::dvec2 at = from + static_cast<double>(n) / std::max(1, steps) * (to - from);
        const auto column = static_cast<std::size_t>(std::clamp(at.x, 0.0, chart.columns - 1.0)),
                   row = static_cast<std::size_t>(std::clamp(at.y, 0.0, chart.rows - 1.0));
        is_touched[row * chart.columns + column] = true;
      }
    }
  }
  return is_touched;
}

/// Of the field's coefficients, those near a touched texel.
std::vector<bool> kept_coefficients(const Chart& chart, const std::vector<bool>& is_touched) {
  const int columns = static_cast<int>(chart.columns), rows = static_cast<int>(chart.rows);
  std::vector<bool> is_kept(static_cast<std::size_t>(columns + 2) * (rows + 2));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (!is_touched[static_cast<std::size_t>(row) * columns + column]) continue;
      for (int j = std::max(0, row + 1 - kKeptAround); j <= std::min(rows + 1, row + 1 + kKeptAround); ++j) {
        for (int i = std::max(0, column + 1 - kKeptAround); i <= std::min(columns + 1, column + 1 + kKeptAround); ++i)
          is_kept[static_cast<std::size_t>(j) * (columns + 2) + i] = true;
      }
    }
  }
  return is_kept;
}

}  // namespace

TriangleMesh on_grid(const TriangleMesh& mesh) {
  const double size_m = glm::length(geometry::bounding_box(mesh).size());
  double step_m = power_of_two_within(std::min(kMostStep_m, size_m / kStepsAcross));
  for (int halving = 0; halving <= kHalvings; ++halving, step_m /= 2) {
    TriangleMesh rounded = mesh;
    for (glm::dvec3& p : rounded.positions_O) p = step_m * glm::round(p / step_m) + 0.0;
    if (keeps_its_sides(mesh, rounded)) return rounded;
  }
  return mesh;
}

void put_frames_on_grid(ChartLayout& layout) {
  const double step_m = power_of_two_within(layout.texel_m / kStepsOfTexel);
  for (ChartPlan& chart : layout.charts) chart.X_OH = codecs::frame_on_grid(chart.X_OH, step_m);
}

void round_thickness(std::vector<double>& piece_thickness_m) {
  constexpr std::uint32_t kLeftOut = (1U << 19) - 1;  // of a float's 23 digits
  for (double& m : piece_thickness_m)
    m = std::bit_cast<float>(std::bit_cast<std::uint32_t>(static_cast<float>(m)) & ~kLeftOut);
}

void round_heights(HapticSurface& surface, const std::vector<BakedChart>& baked, double step_m) {
  const double steps = std::max(1.0, step_m / surface.scale.scale_m);
  surface.scale.scale_m *= steps;
  for (geometry::HeightTile& tile : surface.tiles) {
    for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(std::lround(c / steps));
  }
  std::vector<std::vector<std::uint32_t>> triangles(surface.charts.size());
  for (std::uint32_t t = 0; t < surface.triangle_chart.size(); ++t) triangles[surface.triangle_chart[t]].push_back(t);
  for (std::size_t i = 0; i < baked.size(); ++i) {
    const Chart& chart = surface.charts[i];
    Field field(surface, chart);
    field.level(kept_coefficients(chart, touched_texels(surface, chart, triangles[i], baked[i].is_own)));
    field.put_back();
  }
}

}  // namespace farfeel::slave_sim
