#include "slave_sim/edits/stamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "slave_sim/bake/nearest_on_triangle.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Chart;
using geometry::HapticSurface;
using geometry::HeightTile;
using geometry::kTileSide;
using geometry::kTileTexels;

constexpr double kMostSteps = 65535;  // of a stored height
constexpr double kFacesCosine = 0.2;  // a chart that is turned away further is another side of the object
constexpr double kSmallestDepth_m = 1e-6;

/// Where the ball stands.
struct Ball {
  glm::dvec3 centre_O;
  double radius_m;
};

struct Place {
  std::uint32_t triangle;
  glm::dvec3 p_O, nhat_O;  // of the felt surface
};

/// The felt surface at the coarse surface's point that is nearest.
std::optional<Place> nearest_place(const HapticSurface& surface, const glm::dvec3& p_O) {
  double nearest_m = std::numeric_limits<double>::infinity();
  std::uint32_t triangle = 0;
  glm::dvec3 on_coarse_O{0};
  for (std::uint32_t i = 0; i < surface.coarse.triangles.size(); ++i) {
    const auto& [a, b, c] = surface.coarse.triangles[i];
    const auto& at = surface.coarse.positions_O;
    const glm::dvec3 q_O = nearest_on_triangle(p_O, at[a], at[b], at[c]);
    const double apart_m = glm::distance(p_O, q_O);
    if (apart_m < nearest_m) nearest_m = apart_m, triangle = i, on_coarse_O = q_O;
  }
  if (surface.coarse.triangles.empty() || surface.triangle_chart[triangle] == geometry::kNoChart) return std::nullopt;
  const Chart& chart = surface.charts[surface.triangle_chart[triangle]];
  const glm::dvec3 p_H = spatial::transform_point(spatial::inverse(chart.X_OH), on_coarse_O);
  const geometry::HeightSample sample = sample_height(surface, chart, p_H.x, p_H.y);
  return Place{triangle, spatial::transform_point(chart.X_OH, {p_H.x, p_H.y, sample.h_m}),
               spatial::rotate(chart.X_OH, glm::normalize(glm::dvec3(-sample.h_s, -sample.h_t, 1)))};
}

/// A chart's tile without what is inside the ball, if that changes it. lowest_steps: the lowest stored height that was
/// wanted, in steps, which may be below 0.
std::optional<HeightTile> carved(const HapticSurface& surface, const Chart& chart, std::uint32_t tile, const Ball& ball,
                                 double& lowest_steps) {
  const glm::dvec3 C_H = spatial::transform_point(spatial::inverse(chart.X_OH), ball.centre_O);
  const std::uint32_t local = tile - chart.first_tile;
  const double first_i = static_cast<double>(local % chart.tiles_across()) * kTileTexels - 1,
               first_j = static_cast<double>(local / chart.tiles_across()) * kTileTexels - 1;
  // The tile's farthest texels are half a texel within its borders.
  const auto apart = [&](double first, double at) {
    return std::max({0.0, chart.texel_m * first - at, at - chart.texel_m * (first + kTileSide)});
  };
  if (std::hypot(apart(first_i, C_H.x), apart(first_j, C_H.y)) >= ball.radius_m) return std::nullopt;
  std::optional<HeightTile> changed;
  for (std::uint32_t row = 0; row < kTileSide; ++row) {
    for (std::uint32_t column = 0; column < kTileSide; ++column) {
      const double off_s = chart.texel_m * (first_i + column + 0.5) - C_H.x,
                   off_t = chart.texel_m * (first_j + row + 0.5) - C_H.y;
      const double square = ball.radius_m * ball.radius_m - off_s * off_s - off_t * off_t;
      if (!(square > 0)) continue;
      const std::size_t at = std::size_t{row} * kTileSide + column;
      const double half_m = std::sqrt(square), h_m = surface.scale.height_m(surface.tiles[tile].coefficients[at]);
      if (h_m <= C_H.z - half_m || h_m >= C_H.z + half_m) continue;
      const double steps = std::round((C_H.z - half_m - surface.scale.offset_m) / surface.scale.scale_m);
      lowest_steps = std::min(lowest_steps, steps);
      const auto stored = static_cast<std::uint16_t>(std::clamp(steps, 0.0, kMostSteps));
      if (stored == surface.tiles[tile].coefficients[at]) continue;
      if (!changed) changed = surface.tiles[tile];
      changed->coefficients[at] = stored;
    }
  }
  if (changed) ++changed->version;
  return changed;
}

std::vector<SurfaceEdit> carved(const HapticSurface& surface, std::uint32_t number, const Place& place,
                                const Stamp& stamp, double& lowest_steps) {
  const Ball ball{place.p_O + (stamp.radius_m - stamp.depth_m) * place.nhat_O, stamp.radius_m};
  std::vector<SurfaceEdit> edits;
  for (const Chart& chart : surface.charts) {
    if (glm::dot(spatial::rotate(chart.X_OH, {0, 0, 1}), place.nhat_O) < kFacesCosine) continue;
    const std::uint32_t tiles = chart.tiles_across() * chart.tiles_down();
    for (std::uint32_t tile = chart.first_tile; tile < chart.first_tile + tiles; ++tile) {
      if (const auto changed = carved(surface, chart, tile, ball, lowest_steps))
        edits.push_back({{number, tile}, *changed});
    }
  }
  return edits;
}

/// The least and the greatest stored height.
std::pair<std::uint16_t, std::uint16_t> extremes(const HapticSurface& surface) {
  std::uint16_t least = 0xFFFF, greatest = 0;
  for (const HeightTile& tile : surface.tiles) {
    const auto [low, high] = std::minmax_element(tile.coefficients.begin(), tile.coefficients.end());
    least = std::min(least, *low), greatest = std::max(greatest, *high);
  }
  return {least, greatest};
}

std::string too_deep(const Stamp& stamp, double most_m, const char* why) {
  return fmt::format("{:.3f} mm is too deep here: {}; {:.3f} mm is possible", 1e3 * stamp.depth_m, why,
                     1e3 * std::max(0.0, most_m));
}

}  // namespace

void make_room(HapticSurface& surface, double room_m) {
  if (!surface.is_textured()) return;
  const auto [least, greatest] = extremes(surface);
  const geometry::HeightScale before = surface.scale;
  const double low_m = before.height_m(least) - room_m, range_m = before.height_m(greatest) - low_m;
  const bool fits = range_m <= kMostSteps * before.scale_m;
  // A whole number of steps, so that heights stay what they are.
  const double scale_m = fits ? before.scale_m : range_m / kMostSteps;
  const double lower = std::ceil((before.offset_m - low_m) / scale_m);
  surface.scale = {fits ? before.offset_m - lower * scale_m : low_m, scale_m};
  for (HeightTile& tile : surface.tiles) {
    for (std::uint16_t& c : tile.coefficients) {
      const double steps = std::round((before.height_m(c) - surface.scale.offset_m) / scale_m);
      c = static_cast<std::uint16_t>(std::clamp(steps, 0.0, kMostSteps));
    }
  }
}

void take_room_back(HapticSurface& surface) {
  if (!surface.is_textured()) return;
  const std::uint16_t least = extremes(surface).first;
  surface.scale.offset_m = surface.scale.height_m(least);
  for (HeightTile& tile : surface.tiles) {
    for (std::uint16_t& c : tile.coefficients) c = static_cast<std::uint16_t>(c - least);
  }
}

tl::expected<std::vector<SurfaceEdit>, std::string> stamped(const HapticSurface& surface, std::uint32_t number,
                                                            const Stamp& stamp) {
  const bool is_finite = spatial::is_finite(stamp.p_O) && std::isfinite(stamp.radius_m) && std::isfinite(stamp.depth_m);
  if (!is_finite || !(stamp.depth_m >= kSmallestDepth_m && stamp.depth_m <= stamp.radius_m))
    return tl::unexpected(std::string("a stamp's depth is from 0.001 mm up to the radius of its ball"));
  const auto place = nearest_place(surface, stamp.p_O);
  if (!place) return tl::unexpected(std::string("the surface has no texture here, and so no heights to change"));
  if (const double apart_m = glm::distance(stamp.p_O, place->p_O); apart_m > stamp.radius_m) {
    return tl::unexpected(
        fmt::format("no surface is there: the nearest is {:.1f} mm from the place, and the ball's radius is {:.1f} mm",
                    1e3 * apart_m, 1e3 * stamp.radius_m));
  }
  const std::uint32_t piece = surface.triangle_piece[place->triangle];
  const double thickness_m = surface.piece_thickness_m.empty() ? 0 : surface.piece_thickness_m[piece];
  if (thickness_m > 0 && stamp.depth_m > kMostOfThickness * thickness_m)
    return tl::unexpected(too_deep(stamp, kMostOfThickness * thickness_m, "at most half of the material goes"));
  double lowest_steps = 0;
  auto edits = carved(surface, number, *place, stamp, lowest_steps);
  if (lowest_steps < 0) {
    // Depth and lowest height go together, one for one where the stamp goes straight down, and by less elsewhere.
    return tl::unexpected(
        too_deep(stamp, stamp.depth_m + lowest_steps * surface.scale.scale_m, "the range of the stored heights ends"));
  }
  return edits;
}

}  // namespace farfeel::slave_sim
