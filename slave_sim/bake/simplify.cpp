#include "slave_sim/bake/simplify.h"

#include <meshoptimizer.h>

#include <limits>
#include <optional>
#include <vector>

// OpenMesh's headers are older than our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#pragma GCC diagnostic pop

namespace farfeel::slave_sim {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfedgeMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

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

/// Empty if the mesh is not a manifold.
std::optional<geometry::TriangleMesh> decimated(const geometry::TriangleMesh& mesh, std::uint32_t triangles) {
  if (!geometry::is_closed_and_oriented(mesh)) return std::nullopt;
  HalfedgeMesh halfedges;
  std::vector<HalfedgeMesh::VertexHandle> handle;
  for (const glm::dvec3& p : mesh.positions_O) handle.push_back(halfedges.add_vertex({p.x, p.y, p.z}));
  for (const geometry::Triangle& t : mesh.triangles) {
    if (!halfedges.add_face(handle[t[0]], handle[t[1]], handle[t[2]]).is_valid()) return std::nullopt;
  }
  halfedges.request_face_normals();
  halfedges.update_face_normals();

  using Decimater = OpenMesh::Decimater::DecimaterT<HalfedgeMesh>;
  Decimater decimater(halfedges);
  OpenMesh::Decimater::ModQuadricT<HalfedgeMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<HalfedgeMesh>::Handle flipping;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.module(quadric).unset_max_err();
  decimater.module(flipping).set_max_normal_deviation(60);
  if (decimater.initialize()) decimater.decimate_to_faces(0, triangles);
  halfedges.garbage_collection();

  std::vector<glm::vec3> positions;
  for (const auto v : halfedges.vertices()) {
    const OpenMesh::Vec3d p = halfedges.point(v);
    positions.emplace_back(glm::dvec3(p[0], p[1], p[2]));
  }
  std::vector<std::uint32_t> indices;
  for (const auto f : halfedges.faces()) {
    for (const auto v : halfedges.fv_range(f)) indices.push_back(static_cast<std::uint32_t>(v.idx()));
  }
  return compact(positions, indices);
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

geometry::TriangleMesh simplified(const geometry::TriangleMesh& mesh, std::uint32_t triangles) {
  omerr().disable();  // a mesh that it refuses is no news: the next one is tried
  for (std::uint64_t bulk = 16ULL * triangles; bulk < mesh.triangles.size(); bulk *= 4) {
    if (auto few = decimated(simplified_for_drawing(mesh, static_cast<std::uint32_t>(bulk)), triangles)) return *few;
  }
  if (auto few = decimated(mesh, triangles)) return *few;
  return simplified_for_drawing(mesh, triangles);
}

}  // namespace farfeel::slave_sim
