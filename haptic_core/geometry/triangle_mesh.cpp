#include "haptic_core/geometry/triangle_mesh.h"

#include <limits>
#include <unordered_set>

namespace farfeel::geometry {

Box::Box() : low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity()) {}

void Box::include(const glm::dvec3& p) {
  low = glm::min(low, p);
  high = glm::max(high, p);
}

bool Box::is_empty() const {
  return !(low.x <= high.x && low.y <= high.y && low.z <= high.z);
}
glm::dvec3 Box::size() const {
  return high - low;
}
glm::dvec3 Box::centre() const {
  return 0.5 * (low + high);
}

glm::dvec3 rounded_to_float(const glm::dvec3& p) {
  // Volatile: g++ 12 -O3 drops the rounding when it turns two axes into one vector conversion and back.
  const volatile float x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
  return {x, y, z};
}

Box bounding_box(const TriangleMesh& mesh) {
  Box box;
  for (const glm::dvec3& p : mesh.positions_O) box.include(p);
  return box;
}

glm::dvec3 unit_normal(const TriangleMesh& mesh, const Triangle& t) {
  const glm::dvec3& a = mesh.positions_O[t[0]];
  const glm::dvec3 n = glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0);
}

double signed_volume_m3(const TriangleMesh& mesh) {
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles) {
    six_volumes += glm::dot(mesh.positions_O[t[0]], glm::cross(mesh.positions_O[t[1]], mesh.positions_O[t[2]]));
  }
  return six_volumes / 6.0;
}

bool is_closed_and_oriented(const TriangleMesh& mesh) {
  std::unordered_set<std::uint64_t> open_edges;  // directed edges whose opposite has not been seen
  open_edges.reserve(mesh.triangles.size() * 2);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t from = t[i], to = t[(i + 1) % 3];
      if (from == to) return false;
      if (open_edges.erase(to << 32 | from) == 0 && !open_edges.insert(from << 32 | to).second) return false;
    }
  }
  return open_edges.empty();
}

}  // namespace farfeel::geometry
