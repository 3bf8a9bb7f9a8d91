#include "slave_sim/bake/coarse_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "slave_sim/bake/bare_shape.h"
#include "slave_sim/bake/edge_collapse.h"
#include "slave_sim/bake/full_surface.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

/// Of the thickness that the flattening may take, and the collapsing after it. A fifth costs a tenth more triangles on
/// scans.
constexpr double kShare = 0.25;
constexpr double kLeast_m = 1e-4;     // below it no error is worth a triangle: material of 0.4 mm
constexpr double kMostOfSize = 0.02;  // of the mesh's size: coarse meshes are nearer than that anyway
/// Three quarters of what a depth may be off by. Half of it keeps all sides of a rim of 96.
constexpr double kMostEdgeOff_m = 7.5e-5;
constexpr std::uint32_t kFiner = 64;  // times as many triangles, where relief is looked for
constexpr double kExact = 1e-6;       // of the size
/// Times as many triangles: smooth rims take a quarter more. Ragged edges would take several times as many.
constexpr double kMostForEdges = 1.5;

std::vector<glm::dvec3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<glm::dvec3> normals(mesh.positions_O.size(), glm::dvec3(0));
  for (const Triangle& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions_O[t[0]];
    const glm::dvec3 doubled = glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
    for (const std::uint32_t v : t) normals[v] += doubled;
  }
  return normals;
}

/// Per vertex of `fine`, how far the surface may move there; infinite where it is thick. Looked for along the normals
/// of the bare shape: those of the relief lead across its ridges.
std::vector<double> most_moves_m(const TriangleMesh& fine, const TriangleMesh& bare) {
  const FullSurface surface(fine);
  const double most_m = kMostOfSize * glm::length(geometry::bounding_box(fine).size());
  const std::vector<glm::dvec3> normals = vertex_normals(bare);
  std::vector<double> moves_m(fine.positions_O.size(), std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < moves_m.size(); ++v) {
    if (!(glm::length(normals[v]) > 0)) continue;
    const auto thickness_m = surface.thickness_m(fine.positions_O[v], -glm::normalize(normals[v]));
    if (!thickness_m) continue;
    const double move_m = std::max(kShare * *thickness_m, kLeast_m);
    if (move_m < most_m) moves_m[v] = move_m;
  }
  return moves_m;
}

/// Every vertex of either within most_m of the other.
bool are_near(const TriangleMesh& one, const TriangleMesh& other, double most_m) {
  for (const auto& [from, to] : {std::pair(&one, &other), std::pair(&other, &one)}) {
    const FullSurface surface(*to);
    for (const glm::dvec3& p : from->positions_O) {
      if (!(surface.distance_m(p) <= most_m)) return false;
    }
  }
  return true;
}

}  // namespace

// First to a mesh small enough to be filtered quickly and fine enough to show the relief, then without the relief to
// the coarse one.
TriangleMesh coarse_mesh(const TriangleMesh& full, std::uint32_t triangles) {
  double area_m2 = 0;
  for (const Triangle& t : full.triangles) {
    const glm::dvec3& a = full.positions_O[t[0]];
    area_m2 += 0.5 * glm::length(glm::cross(full.positions_O[t[1]] - a, full.positions_O[t[2]] - a));
  }
  const double side_m = std::sqrt(4 / std::sqrt(3.0) * area_m2 / triangles);
  const TriangleMesh fine = edge_collapsed(full, kFiner * triangles);
  if (fine.triangles.empty()) return fine;
  if (fine.triangles.size() ==
      full.triangles.size()) {  // where it is no finer, its own corners may be taken for relief
    TriangleMesh plain = edge_collapsed(full, triangles);
    if (are_near(full, plain, kExact * glm::length(geometry::bounding_box(full).size()))) return plain;
  }
  TriangleMesh bare = bare_shape(fine, 0.25 * side_m);
  const std::vector<double> moves_m = most_moves_m(fine, bare);
  std::vector<double> edges_off_m(moves_m.size(), std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < moves_m.size(); ++v) {
    const glm::dvec3 move = bare.positions_O[v] - fine.positions_O[v];
    const double length_m = glm::length(move);
    if (length_m < kMostEdgeOff_m) edges_off_m[v] = kMostEdgeOff_m;
    if (length_m > moves_m[v]) bare.positions_O[v] = fine.positions_O[v] + moves_m[v] / length_m * move;
  }
  TriangleMesh without = edge_collapsed(bare, triangles, moves_m);
  TriangleMesh held = edge_collapsed(bare, triangles, moves_m, edges_off_m);
  const double most = kMostForEdges * static_cast<double>(without.triangles.size());
  return static_cast<double>(held.triangles.size()) <= most ? held : without;
}

}  // namespace farfeel::slave_sim
