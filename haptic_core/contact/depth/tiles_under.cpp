#include "haptic_core/contact/depth/tiles_under.h"

#include <limits>

namespace farfeel::contact {
namespace {

constexpr double kBesideTexels = 2;  // a spline reaches one texel, and Newton's last steps a hair further

std::uint32_t tile_index(double texel, std::uint32_t tiles) {
  return static_cast<std::uint32_t>(
      std::clamp(std::floor(texel / geometry::kTileTexels), 0.0, static_cast<double>(tiles - 1)));
}

}  // namespace

/// The box, in the chart, of what stands over the shared part of the facet's box and the window, from the lowest to the
/// highest that it is felt at.
TileRange tiles_of(const penetration::Facet& facet, const penetration::Window& window) noexcept {
  const penetration::Window reached = penetration::within_fade_of(window);
  const glm::dvec2 low = glm::max(facet.low, reached.low), high = glm::min(facet.high, reached.high);
  glm::dvec2 low_H{std::numeric_limits<double>::infinity()}, high_H{-std::numeric_limits<double>::infinity()};
  for (int corner = 0; corner < 4; ++corner) {
    const glm::dvec2 uv{(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y};
    const double z = facet.plane.x + facet.plane.y * uv.x + facet.plane.z * uv.y;
    for (const double felt_z : {z + facet.reach_down_m, z + facet.reach_up_m}) {
      const glm::dvec2 p_H{facet.p_HC_H + facet.R_HC * glm::dvec3{uv, felt_z}};
      low_H = glm::min(low_H, p_H), high_H = glm::max(high_H, p_H);
    }
  }
  const geometry::Chart& chart = *facet.chart;
  const glm::dvec2 first = low_H / chart.texel_m - kBesideTexels, last = high_H / chart.texel_m + kBesideTexels;
  return {.low_column = tile_index(first.x, chart.tiles_across()),
          .end_column = tile_index(last.x, chart.tiles_across()) + 1,
          .low_row = tile_index(first.y, chart.tiles_down()),
          .end_row = tile_index(last.y, chart.tiles_down()) + 1};
}

}  // namespace farfeel::contact
