// Mass properties of a closed mesh of uniform density.
#pragma once

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct MassProperties {
  double mass_kg = 0;
  glm::dvec3 p_OCom_O{0};           ///< centre of mass
  glm::dmat3 inertia_Com_kg_m2{0};  ///< about the centre of mass, axes of O
};

/// By the divergence theorem over the mesh's tetrahedra to the origin; exact for polyhedra. Precondition: closed,
/// oriented.
[[nodiscard]] MassProperties mass_properties(const geometry::TriangleMesh&, double density_kg_per_m3);

}  // namespace farfeel::slave_sim
