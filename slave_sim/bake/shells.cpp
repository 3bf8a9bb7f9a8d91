// A point lies within a closed shell if a ray from it crosses the shell an odd number of times. All is turned by a
// rotation that no file has, so that rays along x meet neither edges nor vertices.
#include "slave_sim/bake/shells.h"

#include <array>
#include <cmath>
#include <limits>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kProbes = 5;  // of a shell that may lie within another

glm::dvec3 middle_of(const TriangleMesh& mesh, std::uint32_t i) {
  const Triangle& t = mesh.triangles[i];
  return (mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0;
}

/// Does the ray from p along x cross the triangle?
bool is_crossed(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  if (std::max({a.x, b.x, c.x}) < p.x || std::min({a.y, b.y, c.y}) > p.y || std::max({a.y, b.y, c.y}) < p.y ||
      std::min({a.z, b.z, c.z}) > p.z || std::max({a.z, b.z, c.z}) < p.z)
    return false;
  const auto side = [&](const glm::dvec3& u, const glm::dvec3& v) {
    return (u.y - p.y) * (v.z - p.z) - (u.z - p.z) * (v.y - p.y);
  };
  const double from_a = side(b, c), from_b = side(c, a), from_c = side(a, b);
  if ((from_a > 0) != (from_b > 0) || (from_b > 0) != (from_c > 0)) return false;
  const double sum = from_a + from_b + from_c;
  return sum != 0 && (from_a * a.x + from_b * b.x + from_c * c.x) / sum > p.x;
}

struct Shell {
  std::vector<std::uint32_t> triangles;
  geometry::Box box;
  double volume_m3 = 0;
};

bool lies_in(const geometry::Box& inner, const geometry::Box& outer) {
  return glm::all(glm::greaterThanEqual(inner.low, outer.low)) && glm::all(glm::lessThanEqual(inner.high, outer.high));
}

/// Does every probe of the inner shell lie within the outer one?
bool lies_in(const TriangleMesh& turned, const Shell& inner, const Shell& outer) {
  if (!lies_in(inner.box, outer.box)) return false;
  for (std::size_t n = 0; n < kProbes; ++n) {
    const glm::dvec3 p = middle_of(turned, inner.triangles[n * inner.triangles.size() / kProbes]);
    bool is_within = false;
    for (const std::uint32_t i : outer.triangles) {
      const Triangle& t = turned.triangles[i];
      is_within ^= is_crossed(p, turned.positions_O[t[0]], turned.positions_O[t[1]], turned.positions_O[t[2]]);
    }
    if (!is_within) return false;
  }
  return true;
}

}  // namespace

Shells orient(TriangleMesh& mesh, const Edges& edges) {
  Shells shells;
  shells.of_triangle.assign(mesh.triangles.size(), kNone);
  std::vector<std::uint32_t> own;
  std::vector<bool> is_turned(mesh.triangles.size());
  for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (shells.of_triangle[seed] != kNone) continue;
    const std::uint32_t shell = shells.count++;
    shells.of_triangle[seed] = shell;
    own.assign(1, seed);
    std::size_t turned = 0;
    for (std::size_t n = 0; n < own.size(); ++n) {
      const std::uint32_t i = own[n];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = mesh.triangles[i][k], to = mesh.triangles[i][(k + 1) % 3];
        const auto& sharing = edges.at(edge_key(from, to));
        if (sharing.size() != 2) continue;
        const std::uint32_t other = sharing[0] == i ? sharing[1] : sharing[0];
        const bool disagrees = runs(mesh.triangles[other], from, to);
        if (shells.of_triangle[other] != kNone) {
          if (disagrees) shells.has_one_side = true;
          continue;
        }
        if (disagrees) std::swap(mesh.triangles[other][1], mesh.triangles[other][2]);
        is_turned[other] = disagrees;
        turned += disagrees;
        shells.of_triangle[other] = shell;
        own.push_back(other);
      }
    }
    const bool is_seed_wrong = 2 * turned > own.size();
    for (const std::uint32_t i : own) {
      if (is_seed_wrong) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
      if (is_turned[i] == is_seed_wrong) continue;
      shells.turned.add(middle_of(mesh, i));
    }
  }
  return shells;
}

Facing face_by_depth(TriangleMesh& mesh, const Shells& shells) {
  const glm::dvec3 centre = geometry::bounding_box(mesh).centre();
  const glm::dmat3 turn(glm::mat3_cast(glm::normalize(glm::dquat(0.83, 0.31, -0.27, 0.37))));
  TriangleMesh turned{.positions_O = {}, .triangles = mesh.triangles};
  for (const glm::dvec3& p : mesh.positions_O) turned.positions_O.push_back(turn * (p - centre));
  std::vector<Shell> all(shells.count);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const glm::dvec3 &a = turned.positions_O[t[0]], &b = turned.positions_O[t[1]], &c = turned.positions_O[t[2]];
    Shell& shell = all[shells.of_triangle[i]];
    shell.triangles.push_back(i);
    shell.volume_m3 += glm::dot(a, glm::cross(b, c)) / 6;
    for (const glm::dvec3* p : {&a, &b, &c}) shell.box.include(*p);
  }
  Facing facing;
  for (const Shell& shell : all) {
    bool is_cavity = false;
    for (const Shell& other : all) {
      if (&other != &shell && lies_in(turned, shell, other)) is_cavity = !is_cavity;
    }
    facing.cavities += is_cavity ? 1 : 0;
    if ((shell.volume_m3 < 0) == is_cavity) continue;
    for (const std::uint32_t i : shell.triangles) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    (is_cavity ? facing.inwards : facing.outwards).add(middle_of(mesh, shell.triangles[0]));
  }
  return facing;
}

}  // namespace farfeel::slave_sim
