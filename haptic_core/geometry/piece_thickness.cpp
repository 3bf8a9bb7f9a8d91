// The way from p along d leaves the mesh through a triangle (a, b, c) with normal n = (b - a) x (c - a), n . d > 0, at
//   t = n . (a - p) / (n . d),
// if p + t d lies between its three sides. Only what is nearer than the piece's least so far is looked at.
#include "haptic_core/geometry/piece_thickness.h"

#include <limits>

namespace farfeel::geometry {
namespace {

constexpr double kUnknown_m = 0, kNone_m = std::numeric_limits<double>::infinity();

struct Plane {
  glm::dvec3 n;  ///< not unit: twice the area long
  double offset;
};

bool is_between(const TriangleMesh& mesh, const Triangle& t, const glm::dvec3& n, const glm::dvec3& q) {
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3& from = mesh.positions_O[t[k]];
    if (glm::dot(glm::cross(mesh.positions_O[t[(k + 1) % 3]] - from, q - from), n) < 0) return false;
  }
  return true;
}

}  // namespace

std::vector<double> measured_thickness_m(const HapticSurface& surface) {
  constexpr std::array<glm::dvec3, 4> kPlaces{{{1 / 3.0, 1 / 3.0, 1 / 3.0},
                                               {2 / 3.0, 1 / 6.0, 1 / 6.0},
                                               {1 / 6.0, 2 / 3.0, 1 / 6.0},
                                               {1 / 6.0, 1 / 6.0, 2 / 3.0}}};
  const TriangleMesh& mesh = surface.coarse;
  std::vector<Plane> planes;
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions_O[t[0]];
    const glm::dvec3 n = glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
    planes.push_back({n, glm::dot(n, a)});
  }
  std::vector<double> least_m(surface.piece_count, kNone_m);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const glm::dvec3 inwards = -unit_normal(mesh, t);
    double& least = least_m[surface.triangle_piece[i]];
    for (const glm::dvec3& w : kPlaces) {
      const glm::dvec3 p = w.x * mesh.positions_O[t[0]] + w.y * mesh.positions_O[t[1]] + w.z * mesh.positions_O[t[2]];
      for (std::size_t other = 0; other < planes.size(); ++other) {
        const double along = glm::dot(planes[other].n, inwards);
        if (!(along > 0)) continue;  // faces the way, or lies along it
        const double up = planes[other].offset - glm::dot(planes[other].n, p);
        if (!(up > 0 && up < least * along) || other == i) continue;
        if (is_between(mesh, mesh.triangles[other], planes[other].n, p + up / along * inwards)) least = up / along;
      }
    }
  }
  for (double& least : least_m) least = least < kNone_m ? static_cast<double>(static_cast<float>(least)) : kUnknown_m;
  return least_m;
}

std::vector<double> piece_thickness_m(const HapticSurface& surface) {
  return surface.piece_thickness_m.empty() ? measured_thickness_m(surface) : surface.piece_thickness_m;
}

}  // namespace farfeel::geometry
