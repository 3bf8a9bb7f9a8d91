// The shape of a mesh without its fine relief: what a coarse mesh should spend its triangles on.
#pragma once

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Flattens relief of wavelengths up to about twice radius_m, and leaves edges where two flat or gently curved sides
/// meet as sharp as they are: the mesh's triangles turn to normals filtered with Kuwahara's idea (a triangle takes the
/// mean normal of those patches around it that agree most with themselves, so that none of its weight comes from across
/// an edge), and the vertices follow (Sun, Rosin, Martin and Langbein, IEEE TVCG 13(5), 2007). Triangles should be
/// smaller than a third of radius_m. Topology stays. Precondition: closed and oriented.
[[nodiscard]] geometry::TriangleMesh bare_shape(const geometry::TriangleMesh&, double radius_m);

}  // namespace farfeel::slave_sim
