#include "haptic_core/penetration/felt_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace farfeel::penetration {
namespace {

using geometry::HapticSurface;

/// Vertices at the same place count as one, whatever their index: a baked mesh may be split along its seams.
std::vector<std::uint32_t> merged_by_position(const std::vector<glm::dvec3>& positions) {
  std::map<std::tuple<double, double, double>, std::uint32_t> seen;
  std::vector<std::uint32_t> merged;
  for (const glm::dvec3& p : positions) {
    merged.push_back(seen.emplace(std::tuple{p.x, p.y, p.z}, static_cast<std::uint32_t>(merged.size())).first->second);
  }
  return merged;
}

std::vector<std::array<std::uint32_t, 3>> neighbours_of(const geometry::TriangleMesh& mesh) {
  const std::vector<std::uint32_t> merged = merged_by_position(mesh.positions_O);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> owner;  // of each directed edge
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t e = 0; e < 3; ++e) {
      owner[{merged[mesh.triangles[i][e]], merged[mesh.triangles[i][(e + 1) % 3]]}] = i;
    }
  }
  std::vector<std::array<std::uint32_t, 3>> neighbours(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t e = 0; e < 3; ++e) {
      const auto across = owner.find({merged[mesh.triangles[i][(e + 1) % 3]], merged[mesh.triangles[i][e]]});
      neighbours[i][e] = across == owner.end() ? kNoTriangle : across->second;
    }
  }
  return neighbours;
}

/// A B-spline lies between the least and greatest of its coefficients, here sampled over the triangle's box in its
/// chart, each against the coarse triangle's own height there.
Relief relief_over(const HapticSurface& surface, std::uint32_t triangle) {
  const std::uint32_t chart_index = surface.triangle_chart[triangle];
  if (chart_index == geometry::kNoChart) return {};
  const geometry::Chart& chart = surface.charts[chart_index];
  const spatial::Pose X_HO = spatial::inverse(chart.X_OH);
  std::array<glm::dvec3, 3> q;
  for (std::size_t k = 0; k < 3; ++k) {
    q[k] = spatial::transform_point(X_HO, surface.coarse.positions_O[surface.coarse.triangles[triangle][k]]);
  }
  const glm::dvec3 normal = glm::cross(q[1] - q[0], q[2] - q[0]);
  if (!(std::abs(normal.z) > 1e-3 * glm::length(normal))) return {};  // stands upright in its chart: felt as coarse
  const glm::dvec2 slope{-normal.x / normal.z, -normal.y / normal.z};
  const double area = normal.z;
  const auto cross2 = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; };

  const auto first = [&](double low, std::uint32_t end) {
    return static_cast<std::int64_t>(std::clamp(std::floor(low / chart.texel_m), 0.0, static_cast<double>(end)));
  };
  const std::int64_t i0 = first(std::min({q[0].x, q[1].x, q[2].x}), chart.columns - 1);
  const std::int64_t i1 = first(std::max({q[0].x, q[1].x, q[2].x}), chart.columns - 1);
  const std::int64_t j0 = first(std::min({q[0].y, q[1].y, q[2].y}), chart.rows - 1);
  const std::int64_t j1 = first(std::max({q[0].y, q[1].y, q[2].y}), chart.rows - 1);
  // Texels more than one from the triangle do not count; one is the spline's reach.
  const double reach =
      -1.5 * chart.texel_m * std::max({glm::length(q[1] - q[0]), glm::length(q[2] - q[1]), glm::length(q[0] - q[2])});
  const double sign = area < 0 ? -1 : 1;
  Relief relief{.low_m = std::numeric_limits<double>::infinity(), .high_m = -std::numeric_limits<double>::infinity()};
  for (std::int64_t j = j0; j <= j1; ++j) {
    for (std::int64_t i = i0; i <= i1; ++i) {
      const glm::dvec2 p{(static_cast<double>(i) + 0.5) * chart.texel_m,
                         (static_cast<double>(j) + 0.5) * chart.texel_m};
      bool is_near = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec2 a{q[k]}, b{q[(k + 1) % 3]};
        is_near = is_near && sign * cross2(b - a, p - a) >= reach;
      }
      if (!is_near) continue;
      const double plane = q[0].z + glm::dot(slope, p - glm::dvec2{q[0]});
      const double height = geometry::sample_height(surface, chart, p.x, p.y).h_m - plane;
      relief.low_m = std::min(relief.low_m, height);
      relief.high_m = std::max(relief.high_m, height);
    }
  }
  if (!(relief.low_m <= relief.high_m)) return {};
  const double margin = 0.05 * (relief.high_m - relief.low_m) + surface.scale.scale_m;  // between the samples
  return {relief.low_m - margin, relief.high_m + margin};
}

/// Greatest difference of neighbours along either side, in coefficients: a spline's slope is a mean of such.
struct Differences {
  int across = 0, down = 0;
};

Differences differences_of(const geometry::HeightTile& tile, std::uint32_t columns, std::uint32_t rows) noexcept {
  constexpr std::uint32_t kSide = geometry::kTileSide;
  Differences most;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint16_t* c = tile.coefficients.data() + row * kSide;
    for (std::uint32_t i = 1; i < columns; ++i) most.across = std::max(most.across, std::abs(c[i] - c[i - 1]));
    if (row + 1 == rows) break;
    for (std::uint32_t i = 0; i < columns; ++i) most.down = std::max(most.down, std::abs(c[i + kSide] - c[i]));
  }
  return most;
}

std::vector<Relief> reliefs_of(const HapticSurface& surface) {
  std::vector<Relief> reliefs;
  for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) reliefs.push_back(relief_over(surface, i));
  return reliefs;
}

}  // namespace

FeltSurface::FeltSurface(const HapticSurface& surface) : FeltSurface(surface, {reliefs_of(surface), {}}) {
  for (std::size_t i = 0; i < surface.charts.size(); ++i) {
    const BoundsLevel coarsest = bounds_[i].level(kBoundsLevels - 1);
    std::uint32_t most = 0;
    for (std::uint32_t k = 0; k < coarsest.columns * coarsest.rows; ++k)
      most = std::max(most, coarsest.entries[k] >> 16);
    const double texel_m = surface.charts[i].texel_m;
    limits_.most_bends_1_per_m.push_back(kBendUnit * most * surface.scale.scale_m / (texel_m * texel_m));
  }
}

FeltSurface::FeltSurface(const HapticSurface& surface, HeightLimits limits)
    : surface_(&surface), neighbours_(neighbours_of(surface.coarse)), limits_(std::move(limits)) {
  const std::size_t count = surface.coarse.triangles.size();
  piece_start_.assign(surface.piece_count + 1, 0);
  for (const std::uint32_t piece : surface.triangle_piece) ++piece_start_[piece + 1];
  for (std::size_t p = 0; p < surface.piece_count; ++p) piece_start_[p + 1] += piece_start_[p];
  piece_triangles_.resize(count);
  std::vector<std::uint32_t> next(piece_start_.begin(), piece_start_.end() - 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    piece_triangles_[next[surface.triangle_piece[i]]++] = i;
    normals_O_.push_back(geometry::unit_normal(surface.coarse, surface.coarse.triangles[i]));
  }
  tile_chart_.assign(surface.tiles.size(), geometry::kNoChart);
  tile_changes_.assign(surface.tiles.size(), 0);
  std::size_t packed = 0;
  for (std::uint32_t c = 0; c < surface.charts.size(); ++c) {
    const geometry::Chart& chart = surface.charts[c];
    packed_start_.push_back(packed);
    packed += std::size_t{chart.columns + 2} * (chart.rows + 2);
    const std::uint32_t tiles = chart.tiles_across() * chart.tiles_down();
    std::fill_n(tile_chart_.begin() + chart.first_tile, tiles, c);
  }
  packed_.resize(packed + 4);  // four are loaded at a time
  most_slopes_.assign(surface.charts.size(), 0);
  for (std::uint32_t tile = 0; tile < surface.tiles.size(); ++tile) {
    if (tile_chart_[tile] != geometry::kNoChart) pack(tile);
  }
  for (std::size_t i = 0; i < surface.charts.size(); ++i) {
    const geometry::Chart& chart = surface.charts[i];
    axes_O_.push_back(spatial::rotate(chart.X_OH, {0, 0, 1}));
    bounds_.emplace_back(packed_.data() + packed_start_[i], chart.columns, chart.rows);
  }
}

FeltSurface::TilePlace FeltSurface::place_of(std::uint32_t tile) const noexcept {
  const geometry::Chart& chart = surface_->charts[tile_chart_[tile]];
  const std::uint32_t place = tile - chart.first_tile;
  const std::uint32_t first_i = place % chart.tiles_across() * geometry::kTileTexels;
  const std::uint32_t first_j = place / chart.tiles_across() * geometry::kTileTexels;
  return {tile_chart_[tile], first_i, first_j, std::min(geometry::kTileSide, chart.columns + 2 - first_i),
          std::min(geometry::kTileSide, chart.rows + 2 - first_j)};
}

void FeltSurface::pack(std::uint32_t tile) noexcept {
  const TilePlace place = place_of(tile);
  const std::uint32_t stride = surface_->charts[place.chart].columns + 2;
  const std::uint16_t* from = surface_->tiles[tile].coefficients.data();
  std::uint16_t* to =
      packed_.data() + packed_start_[place.chart] + std::size_t{place.first_row} * stride + place.first_column;
  for (std::uint32_t row = 0; row < place.rows; ++row, from += geometry::kTileSide, to += stride)
    std::copy_n(from, place.columns, to);
  const Differences most = differences_of(surface_->tiles[tile], place.columns, place.rows);
  const double slope =
      std::hypot(most.across, most.down) * surface_->scale.scale_m / surface_->charts[place.chart].texel_m;
  most_slopes_[place.chart] = std::max(most_slopes_[place.chart], slope);
}

void FeltSurface::take_tile(std::uint32_t tile) noexcept {
  if (tile_chart_[tile] == geometry::kNoChart) return;
  pack(tile);
  tile_changes_[tile] = ++changes_;
  const TilePlace place = place_of(tile);
  // Texel (i, j) is made from coefficients i ... i + 2, j ... j + 2.
  bounds_[place.chart].update(
      packed_.data() + packed_start_[place.chart],
      {place.first_column - std::min(place.first_column, 2u), place.first_column + place.columns,
       place.first_row - std::min(place.first_row, 2u), place.first_row + place.rows});
  if (surface_->tiles[tile].version > 0) widen_limits(tile);
}

/// By the tile's least and greatest coefficient against the coarse triangles under it: never too little, and often more
/// than a look at every texel would say.
void FeltSurface::widen_limits(std::uint32_t tile) noexcept {
  const TilePlace place = place_of(tile);
  const geometry::Chart& chart = surface_->charts[place.chart];
  std::uint16_t least = 0xFFFF, greatest = 0;
  for (std::uint32_t row = 0; row < place.rows; ++row) {
    const auto* first = surface_->tiles[tile].coefficients.data() + row * geometry::kTileSide;
    const auto [low, high] = std::minmax_element(first, first + place.columns);
    least = std::min(least, *low), greatest = std::max(greatest, *high);
  }
  const double low_m = surface_->scale.height_m(least), high_m = surface_->scale.height_m(greatest);
  // Coefficients reach one texel beyond their own, and stand one before it.
  const glm::dvec2 first = chart.texel_m * (glm::dvec2(place.first_column, place.first_row) - 2.0);
  const glm::dvec2 last =
      chart.texel_m * (glm::dvec2(place.first_column + place.columns, place.first_row + place.rows) + 1.0);
  const spatial::Pose X_HO = spatial::inverse(chart.X_OH);
  for (std::uint32_t i = 0; i < limits_.reliefs.size(); ++i) {
    if (surface_->triangle_chart[i] != place.chart) continue;
    std::array<glm::dvec3, 3> q;
    for (std::size_t k = 0; k < 3; ++k)
      q[k] = spatial::transform_point(X_HO, surface_->coarse.positions_O[surface_->coarse.triangles[i][k]]);
    const glm::dvec2 from = glm::max(first, glm::min(glm::min(glm::dvec2(q[0]), glm::dvec2(q[1])), glm::dvec2(q[2])));
    const glm::dvec2 to = glm::min(last, glm::max(glm::max(glm::dvec2(q[0]), glm::dvec2(q[1])), glm::dvec2(q[2])));
    const glm::dvec3 normal = glm::cross(q[1] - q[0], q[2] - q[0]);
    if (from.x > to.x || from.y > to.y || !(std::abs(normal.z) > 1e-3 * glm::length(normal))) continue;
    double plane_low_m = std::numeric_limits<double>::infinity(), plane_high_m = -plane_low_m;
    for (const glm::dvec2& p : {from, to, glm::dvec2(from.x, to.y), glm::dvec2(to.x, from.y)}) {
      const double plane_m = q[0].z - (normal.x * (p.x - q[0].x) + normal.y * (p.y - q[0].y)) / normal.z;
      plane_low_m = std::min(plane_low_m, plane_m), plane_high_m = std::max(plane_high_m, plane_m);
    }
    limits_.reliefs[i].low_m = std::min(limits_.reliefs[i].low_m, low_m - plane_high_m);
    limits_.reliefs[i].high_m = std::max(limits_.reliefs[i].high_m, high_m - plane_low_m);
  }
  const BoundsLevel coarsest = bounds_[place.chart].level(kBoundsLevels - 1);
  double& most_bend = limits_.most_bends_1_per_m[place.chart];
  for (std::uint32_t k = 0; k < coarsest.columns * coarsest.rows; ++k)
    most_bend = std::max(
        most_bend, kBendUnit * (coarsest.entries[k] >> 16) * surface_->scale.scale_m / (chart.texel_m * chart.texel_m));
}

std::span<const std::uint32_t> FeltSurface::triangles_of_piece(std::uint32_t piece) const {
  return {piece_triangles_.data() + piece_start_[piece], piece_start_[piece + 1] - piece_start_[piece]};
}

}  // namespace farfeel::penetration
