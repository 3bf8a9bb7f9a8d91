#include "slave_sim/bake/drawn_mesh.h"

#include <meshoptimizer.h>

#include <limits>
#include <vector>

namespace farfeel::slave_sim {
namespace {

/// Only the vertices that triangles use, in first-use order.
geometry::TriangleMesh compact(const std::vector<glm::vec3>& positions, const std::vector<std::uint32_t>& indices) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> renamed(positions.size(), kUnused);
  geometry::TriangleMesh out;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    geometry::Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& name = renamed[indices[i + k]];
      if (name == kUnused) {
        name = static_cast<std::uint32_t>(out.positions_O.size());
        out.positions_O.emplace_back(positions[indices[i + k]]);
      }
      t[k] = name;
    }
    out.triangles.push_back(t);
  }
  return out;
}

}  // namespace

geometry::TriangleMesh simplified_for_drawing(const geometry::TriangleMesh& mesh, std::uint32_t triangles) {
  std::vector<glm::vec3> positions(mesh.positions_O.begin(), mesh.positions_O.end());
  std::vector<std::uint32_t> indices;
  indices.reserve(mesh.triangles.size() * 3);
  for (const geometry::Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  if (mesh.triangles.size() > triangles) {
    std::vector<std::uint32_t> fewer(indices.size());
    const std::size_t count =
        meshopt_simplify(fewer.data(), indices.data(), indices.size(), &positions[0].x, positions.size(),
                         sizeof(glm::vec3), static_cast<std::size_t>(triangles) * 3, /*target_error=*/1.0F);
    fewer.resize(count);
    indices = std::move(fewer);
  }
  return compact(positions, indices);
}

std::vector<codecs::Colour> colours_at(const std::vector<glm::dvec3>& points, const std::vector<glm::dvec3>& places,
                                       const std::vector<codecs::Colour>& colours) {
  const codecs::NearestPoint nearest(places);
  std::vector<codecs::Colour> out;
  if (colours.empty() || nearest.is_empty()) return out;
  for (const glm::dvec3& p : points) out.push_back(colours[nearest.to(p)]);
  return out;
}

}  // namespace farfeel::slave_sim
