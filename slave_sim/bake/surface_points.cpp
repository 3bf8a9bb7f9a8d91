#include "slave_sim/bake/surface_points.h"

#include <algorithm>
#include <cmath>

namespace farfeel::slave_sim {

SurfacePoints::SurfacePoints(const geometry::TriangleMesh& mesh, std::uint64_t seed) : mesh_(mesh), random_(seed) {
  double area = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions_O[t[0]];
    area += 0.5 * glm::length(glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a));
    area_up_to_.push_back(area);
  }
}

SurfacePoints::Point SurfacePoints::next() {
  const auto found = std::lower_bound(area_up_to_.begin(), area_up_to_.end(), area_up_to_.back() * unit_(random_));
  const std::size_t index = std::min<std::size_t>(found - area_up_to_.begin(), mesh_.triangles.size() - 1);
  const geometry::Triangle& t = mesh_.triangles[index];
  const double root = std::sqrt(unit_(random_)), v = unit_(random_) * root;
  const glm::dvec3 p_O =
      (1 - root) * mesh_.positions_O[t[0]] + (root - v) * mesh_.positions_O[t[1]] + v * mesh_.positions_O[t[2]];
  return {p_O, geometry::unit_normal(mesh_, t)};
}

}  // namespace farfeel::slave_sim
