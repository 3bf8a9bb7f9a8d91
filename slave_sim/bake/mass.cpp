// For the tetrahedron (0, a, b, c) with D = det[a b c]: volume D/6, first moment D/24 (a + b + c), and second moment
//   integral x x^T = D/120 (s s^T + a a^T + b b^T + c c^T),  s = a + b + c.
// The inertia about the origin is trace(C) I - C of the summed second moment C.
#include "slave_sim/bake/mass.h"

namespace farfeel::slave_sim {

MassProperties mass_properties(const geometry::TriangleMesh& mesh, double density_kg_per_m3) {
  const glm::dvec3 near = geometry::bounding_box(mesh).centre();  // moments about a near point lose fewer digits
  double six_volumes = 0;
  glm::dvec3 first(0);
  glm::dmat3 second(0);
  for (const geometry::Triangle& t : mesh.triangles) {
    const glm::dvec3 a = mesh.positions_O[t[0]] - near, b = mesh.positions_O[t[1]] - near,
                     c = mesh.positions_O[t[2]] - near;
    const double D = glm::dot(a, glm::cross(b, c));
    const glm::dvec3 s = a + b + c;
    six_volumes += D;
    first += D / 24 * s;
    second += D / 120 *
              (glm::outerProduct(s, s) + glm::outerProduct(a, a) + glm::outerProduct(b, b) + glm::outerProduct(c, c));
  }
  const double volume = six_volumes / 6;
  const glm::dvec3 centre = first / volume;
  const glm::dmat3 about_centre = density_kg_per_m3 * (second - volume * glm::outerProduct(centre, centre));
  const double trace = about_centre[0][0] + about_centre[1][1] + about_centre[2][2];
  return {.mass_kg = density_kg_per_m3 * volume,
          .p_OCom_O = near + centre,
          .inertia_Com_kg_m2 = trace * glm::dmat3(1) - about_centre};
}

}  // namespace farfeel::slave_sim
