#include "slave_sim/bake/near_pairs.h"

#include <algorithm>
#include <vector>

#include "slave_sim/bake/nearest_on_triangle.h"
#include "slave_sim/bake/surface_points.h"

namespace farfeel::slave_sim {

std::uint32_t near_pairs_p95(const geometry::HapticSurface& surface) {
  constexpr std::uint32_t kPlaces = 400;
  const geometry::TriangleMesh& mesh = surface.coarse;
  const double radius_m = 0.5 * kBallShare * glm::length(geometry::bounding_box(mesh).size());
  SurfacePoints places(mesh, 4);
  std::vector<std::uint32_t> counts;
  std::vector<std::uint32_t> last_near(surface.piece_count, kPlaces);
  for (std::uint32_t place = 0; place < kPlaces; ++place) {
    const SurfacePoints::Point at = places.next();
    const glm::dvec3 centre_O = at.p_O + radius_m * at.nhat_O;
    std::uint32_t near = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const geometry::Triangle& t = mesh.triangles[i];
      std::uint32_t& last = last_near[surface.triangle_piece[i]];
      if (last == place) continue;
      const glm::dvec3 nearest_O =
          nearest_on_triangle(centre_O, mesh.positions_O[t[0]], mesh.positions_O[t[1]], mesh.positions_O[t[2]]);
      if (glm::distance(nearest_O, centre_O) < 2 * radius_m) last = place, ++near;
    }
    counts.push_back(near);
  }
  const auto p95 = counts.begin() + static_cast<std::ptrdiff_t>(0.95 * kPlaces);
  std::nth_element(counts.begin(), p95, counts.end());
  return *p95;
}

}  // namespace farfeel::slave_sim
