// A coarse mesh from a full one.
#pragma once

#include <cstdint>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Quadric error metric; vertices are a subset of the mesh's, rounded to float. meshoptimizer: fast (650,000 triangles
/// in half a second), but what comes out need not be a manifold: good for drawing.
[[nodiscard]] geometry::TriangleMesh simplified_for_drawing(const geometry::TriangleMesh&, std::uint32_t triangles);

/// At most a few triangles more than `triangles`, unless the topology needs more; closed and oriented when the mesh is,
/// vertices exactly representable in float. meshoptimizer takes the bulk off as far as it leaves a manifold, OpenMesh
/// does the rest and refuses flips.
[[nodiscard]] geometry::TriangleMesh simplified(const geometry::TriangleMesh&, std::uint32_t triangles);

}  // namespace farfeel::slave_sim
