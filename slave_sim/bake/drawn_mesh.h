// The mesh that is drawn: fewer triangles than the full one, and nothing that is felt.
#pragma once

#include <cstdint>
#include <vector>

#include "codecs/mesh/colours.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Quadric error metric; vertices are a subset of the mesh's, rounded to float. meshoptimizer: fast (650,000 triangles
/// in half a second), but what comes out need not be a manifold: good for drawing only.
[[nodiscard]] geometry::TriangleMesh simplified_for_drawing(const geometry::TriangleMesh&, std::uint32_t triangles);

/// Of each point the colour of the nearest place; none without places or colours.
[[nodiscard]] std::vector<codecs::Colour> colours_at(const std::vector<glm::dvec3>& points,
                                                     const std::vector<glm::dvec3>& places,
                                                     const std::vector<codecs::Colour>& colours);

}  // namespace farfeel::slave_sim
