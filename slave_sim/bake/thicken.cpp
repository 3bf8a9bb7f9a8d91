// A vertex moves by the d that takes the planes of its triangles, with unit normals n and areas w, back by the
// thickness h: sum w (n . d + h)^2 is least, where (sum w n n^T) d = -h sum w n. On a smooth place that is -h n, at a
// corner its mitre. Of a border edge that a triangle runs along from a to b, with a' and b' behind, the wall is (b, a,
// a') and (b, a', b'): it runs along the edge the other way, and along the back's the way that the back, turned, does
// not.
#include "slave_sim/bake/thicken.h"

#include <limits>

namespace farfeel::slave_sim {
namespace {

/// d as above, along the mean normal where the planes leave it free; a sharp corner's is not longer than some times h.
glm::dvec3 way_back(const glm::dmat3& square, const glm::dvec3& sum, double thickness_m) {
  constexpr double kPull = 1e-6, kLongest = 3;  // of the planes together; of h
  const double all = square[0][0] + square[1][1] + square[2][2], length = glm::length(sum);
  if (!(all > 0) || !(length > 0)) return glm::dvec3(0);
  const glm::dvec3 plain = -thickness_m / length * sum;
  const glm::dvec3 d = glm::inverse(square + kPull * all * glm::dmat3(1)) * (-thickness_m * sum + kPull * all * plain);
  const double most = kLongest * thickness_m;
  return glm::length(d) > most ? most / glm::length(d) * d : d;
}

}  // namespace

Found thicken_open_shells(geometry::TriangleMesh& mesh, const Shells& shells, const Edges& edges, double thickness_m) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<bool> is_open(shells.count);
  for (const auto& [key, sharing] : edges) {
    if (sharing.size() == 1) is_open[shells.of_triangle[sharing[0]]] = true;
  }
  const std::vector<geometry::Triangle> front = mesh.triangles;
  struct Planes {
    glm::dmat3 square{0};
    glm::dvec3 sum{0};
  };
  std::vector<Planes> planes(mesh.positions_O.size());
  for (std::size_t i = 0; i < front.size(); ++i) {
    if (!is_open[shells.of_triangle[i]]) continue;
    const glm::dvec3& a = mesh.positions_O[front[i][0]];
    const glm::dvec3 doubled = glm::cross(mesh.positions_O[front[i][1]] - a, mesh.positions_O[front[i][2]] - a);
    const double twice_area = glm::length(doubled);
    if (!(twice_area > 0)) continue;
    for (const std::uint32_t v : front[i]) {
      planes[v].sum += doubled;
      planes[v].square += glm::outerProduct(doubled, doubled) / twice_area;
    }
  }
  std::vector<std::uint32_t> behind(planes.size(), kNone);
  const auto back_of = [&](std::uint32_t v) {
    if (behind[v] == kNone) {
      behind[v] = static_cast<std::uint32_t>(mesh.positions_O.size());
      mesh.positions_O.push_back(mesh.positions_O[v] + way_back(planes[v].square, planes[v].sum, thickness_m));
    }
    return behind[v];
  };
  Found thickened;
  std::vector<bool> is_met(shells.count);
  for (std::uint32_t i = 0; i < front.size(); ++i) {
    const std::uint32_t shell = shells.of_triangle[i];
    if (!is_open[shell]) continue;
    if (!is_met[shell]) thickened.add(mesh.positions_O[front[i][0]]);
    is_met[shell] = true;
    mesh.triangles.push_back({back_of(front[i][0]), back_of(front[i][2]), back_of(front[i][1])});
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = front[i][k], b = front[i][(k + 1) % 3];
      if (edges.at(edge_key(a, b)).size() != 1) continue;
      mesh.triangles.push_back({b, a, back_of(a)});
      mesh.triangles.push_back({b, back_of(a), back_of(b)});
    }
  }
  return thickened;
}

}  // namespace farfeel::slave_sim
