// Heights of a surface over a chart's plane, texel by texel: what is felt there.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/geometry/height_field_fit.h"

namespace farfeel::codecs {

struct ChartHeights {
  geometry::SampledChart heights;
  std::vector<bool> is_own;           ///< per texel: its centre is under one of the chart's own triangles
  std::uint64_t own = 0, missed = 0;  ///< own texels, and those of them where the surface was not found
};

/// At a place of the chart's plane, how far above near_m the surface is that faces up within 75 degrees, at most
/// reach_m above or below; the nearest, if there are several.
using HeightNear = std::function<std::optional<double>(const glm::dvec2& at_m, double near_m, double reach_m)>;

/// rays_across x rays_across looks a texel: one gives heights at texels' centres, more their means, so that what is
/// finer than the texels is left out instead of aliased. Where the surface goes on beyond the chart's own triangles the
/// texels follow it, so that neighbouring charts describe the same surface; where it ends (an edge, a gap) they go on
/// smoothly. reach_m: how far it may be from the coarse mesh. Of the chart its tiles are not looked at.
[[nodiscard]] ChartHeights chart_heights(const geometry::TriangleMesh& coarse, std::span<const std::uint32_t> triangles,
                                         const geometry::Chart&, const HeightNear&, double reach_m, int rays_across);

}  // namespace farfeel::codecs
