// A sphere: an icosahedron whose triangles are split in four, again and again, every vertex moved onto the sphere.
// 20 * 4^n triangles: 20,480 for n = 5, 320 for n = 2.
#include <cmath>
#include <cstddef>
#include <numbers>

#include "haptic_core/geometry/quartered.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kRadius_m = 0.003;

/// On the unit sphere.
geometry::TriangleMesh icosahedron() {
  geometry::TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double one : {-1.0, 1.0}) {
      for (const double golden : {-std::numbers::phi, std::numbers::phi}) {
        glm::dvec3 p(0);
        p[(axis + 1) % 3] = one, p[(axis + 2) % 3] = golden;
        mesh.positions_O.push_back(p);
      }
    }
  }
  // Neighbours are two apart; every three mutual neighbours are a face.
  const auto& p = mesh.positions_O;
  const auto are_near = [&](std::uint32_t a, std::uint32_t b) { return glm::length(p[a] - p[b]) < 2.1; };
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!are_near(a, b) || !are_near(b, c) || !are_near(c, a)) continue;
        const bool is_outward = glm::dot(glm::cross(p[b] - p[a], p[c] - p[a]), p[a]) > 0;
        mesh.triangles.push_back(is_outward ? geometry::Triangle{a, b, c} : geometry::Triangle{a, c, b});
      }
    }
  }
  for (glm::dvec3& v : mesh.positions_O) v = glm::normalize(v);
  return mesh;
}

geometry::TriangleMesh sphere(int splits) {
  geometry::TriangleMesh mesh = icosahedron();
  for (; splits > 0; --splits) {
    const auto first = static_cast<std::ptrdiff_t>(mesh.positions_O.size());
    mesh = geometry::quartered(mesh);
    for (auto p = mesh.positions_O.begin() + first; p != mesh.positions_O.end(); ++p) *p = glm::normalize(*p);
  }
  for (glm::dvec3& p : mesh.positions_O) p *= kRadius_m;
  return mesh;
}

}  // namespace

geometry::TriangleMesh probe_mesh() {
  return sphere(5);
}

geometry::TriangleMesh probe_base() {
  geometry::TriangleMesh mesh = sphere(2);
  const double volume_m3 = 4.0 / 3 * std::numbers::pi * kRadius_m * kRadius_m * kRadius_m;
  const double grown = std::cbrt(volume_m3 / geometry::signed_volume_m3(mesh));
  for (glm::dvec3& p : mesh.positions_O) p *= grown;
  return mesh;
}

}  // namespace farfeel::slave_sim
