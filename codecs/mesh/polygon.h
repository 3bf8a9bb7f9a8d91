// Polygons of files, cut into triangles that lie inside them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

/// Adds triangles that cover the polygon and nothing else, and that turn as it does: corners may be concave, in line,
/// or meet (a hole reached by a bridge), and need not lie in one plane: then its outline is looked at along its mean
/// normal. All corners are used, so that neighbours meet along whole edges. Nothing is added where that cannot be done,
/// and what is wrong comes back: its outline crosses itself. Precondition: every corner names a position.
[[nodiscard]] std::optional<std::string_view> cut_polygon(const std::vector<glm::dvec3>& positions,
                                                          std::span<const std::uint32_t> corners,
                                                          std::vector<geometry::Triangle>& out);

}  // namespace farfeel::codecs
