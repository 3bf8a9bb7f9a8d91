#include "tests/support/bad_meshes.h"

#include <array>
#include <cmath>
#include <utility>

#include "slave_sim/models/lattice_solid.h"
#include "tests/support/solids.h"

namespace farfeel::support {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

/// A cube of 40 mm with so many squares along an edge.
TriangleMesh cube(std::uint32_t squares) {
  const slave_sim::LatticeSolid solid{.cuts_m = {{{-0.02, 0.02}, {-0.02, 0.02}, {-0.02, 0.02}}},
                                      .steps = {{{squares}, {squares}, {squares}}},
                                      .is_solid = [](int, int, int) { return true; }};
  return slave_sim::skin(solid, [](const slave_sim::LatticePoint& at) { return at.p; });
}

TriangleMesh both(TriangleMesh one, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(one.positions_O.size());
  one.positions_O.insert(one.positions_O.end(), other.positions_O.begin(), other.positions_O.end());
  for (const Triangle& t : other.triangles) one.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return one;
}

TriangleMesh placed(TriangleMesh mesh, double scale, const glm::dvec3& at) {
  for (glm::dvec3& p : mesh.positions_O) p = scale * p + at;
  return mesh;
}

TriangleMesh inside_out(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Without the triangles whose middle is in the hole.
template <typename IsHole>
TriangleMesh opened(TriangleMesh mesh, const IsHole& is_hole) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return is_hole((mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0);
  });
  return mesh;
}

TriangleMesh bumpy_ball_of(std::uint32_t sides, std::uint32_t rows) {
  return bumpy_ball_mesh({.radius_m = 0.03, .bump_m = 4e-4, .sides = sides, .rows = rows});
}
TriangleMesh bumpy_ball() {
  return bumpy_ball_of(500, 250);
}
TriangleMesh bumpy_ball_half_million() {
  return bumpy_ball_of(1000, 251);
}
TriangleMesh bumpy_ball_two_million() {
  return bumpy_ball_of(2000, 501);
}

TriangleMesh smooth_ball() {
  return bumpy_ball_mesh({.radius_m = 0.03, .bump_m = 0, .sides = 280, .rows = 141});
}

TriangleMesh turned_with_fans() {
  return cylinder_mesh(0.02, 0.05, 720);
}

TriangleMesh cube_of_48() {
  return cube(2);
}

/// A ball in a sheath of 36 specks, each too small for a shell of its own.
TriangleMesh specks() {
  TriangleMesh mesh = smooth_ball();
  for (int i = 0; i < 36; ++i) {
    const double z = (i + 0.5) / 18 - 1, turn = 2.4 * i, r = std::sqrt(1 - z * z);
    mesh =
        both(std::move(mesh), placed(cube(1), 0.0125, 0.031 * glm::dvec3(r * std::cos(turn), r * std::sin(turn), z)));
  }
  return mesh;
}

/// Sheets of half a millimetre that stand on the edges of a cube's squares.
TriangleMesh fins() {
  TriangleMesh mesh = cube(40);
  const std::vector<Triangle> own = mesh.triangles;
  for (std::size_t i = 0; i < own.size(); i += 97) {
    const glm::dvec3 out = geometry::unit_normal(mesh, own[i]);
    const glm::dvec3 &a = mesh.positions_O[own[i][0]], &b = mesh.positions_O[own[i][1]];
    const auto tip = static_cast<std::uint32_t>(mesh.positions_O.size());
    mesh.positions_O.push_back(0.5 * (a + b) + 5e-4 * out);
    mesh.triangles.push_back({own[i][0], own[i][1], tip});
  }
  return mesh;
}

TriangleMesh nested_shells() {
  return both(both(cube(4), placed(cube(4), 0.7, {})), placed(cube(4), 0.4, {}));
}
TriangleMesh crossing_bodies() {
  return both(cube(8), placed(cube(8), 1, {0.015, 0.011, 0.007}));
}
TriangleMesh cubes_that_share_an_edge() {
  return both(cube(1), placed(cube(1), 1, {0.04, 0.04, 0}));
}
TriangleMesh face_to_face() {
  return both(cube(2), placed(cube(2), 1, {0.04, 0, 0}));
}

/// One side has a vertex on the other's edge.
TriangleMesh t_junction() {
  TriangleMesh mesh = cube(1);
  const Triangle t = mesh.triangles.front();
  const auto middle = static_cast<std::uint32_t>(mesh.positions_O.size());
  mesh.positions_O.push_back(0.5 * (mesh.positions_O[t[0]] + mesh.positions_O[t[1]]));
  mesh.triangles.front() = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  return mesh;
}

TriangleMesh doubled_triangles() {
  TriangleMesh mesh = cube(8);
  mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.begin() + 30);
  return mesh;
}

TriangleMesh one_turned() {
  TriangleMesh mesh = cube(8);
  std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
  return mesh;
}

TriangleMesh turned_whole() {
  return inside_out(cube(8));
}

TriangleMesh small_hole() {
  return opened(cube(20), [](const glm::dvec3& p) { return p.z > 0.0199 && glm::length(glm::dvec2(p)) < 0.003; });
}
TriangleMesh open_box() {
  return opened(cube(20), [](const glm::dvec3& p) { return p.z > 0.0199; });
}
TriangleMesh flat_sheet() {
  return opened(cube(20), [](const glm::dvec3& p) { return p.z < 0.0199; });
}

TriangleMesh moebius_strip() {
  constexpr std::uint32_t kSteps = 60;
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const double turn = 6.283185307179586 * i / kSteps;
    const glm::dvec3 out(std::cos(turn), std::sin(turn), 0);
    const glm::dvec3 across = std::cos(turn / 2) * out + glm::dvec3(0, 0, std::sin(turn / 2));
    mesh.positions_O.push_back(0.03 * out - 0.002 * across);
    mesh.positions_O.push_back(0.03 * out + 0.002 * across);
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const bool is_last = i + 1 == kSteps;
    const std::uint32_t a = 2 * i, b = 2 * i + 1, c = is_last ? 1 : 2 * i + 2, d = is_last ? 0 : 2 * i + 3;
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
  return mesh;
}

constexpr double kCube_m3 = 64e-6;  // of 40 mm
constexpr std::array kAll{
    BadMesh{"bad-fans-720", true, turned_with_fans, ""},
    BadMesh{.name = "bad-bumpy-ball-250k", .is_baked = true, .make = bumpy_ball, .words = "", .is_large = true},
    BadMesh{.name = "bad-bumpy-ball-500k",
            .is_baked = true,
            .make = bumpy_ball_half_million,
            .words = "",
            .is_large = true},
    BadMesh{.name = "bad-bumpy-ball-2M",
            .is_baked = true,
            .make = bumpy_ball_two_million,
            .words = "",
            .is_large = true,
            .is_huge = true},
    BadMesh{.name = "bad-smooth-ball-79k", .is_baked = true, .make = smooth_ball, .words = "", .is_large = true},
    BadMesh{"bad-cube-48", true, cube_of_48, "", kCube_m3},
    BadMesh{.name = "bad-specks", .is_baked = true, .make = specks, .words = "36 specks", .is_large = true},
    BadMesh{"bad-fins", true, fins, "fins (sheets that hang on an edge) dropped", kCube_m3},
    BadMesh{"bad-nested-shells", true, nested_shells, "1 shells that lie within another turned inwards",
            (1 - 0.343 + 0.064) * kCube_m3},
    BadMesh{"bad-crossing-bodies", true, crossing_bodies, "the surface passes through itself", 2 * kCube_m3},
    BadMesh{"bad-shared-edge", true, cubes_that_share_an_edge, "1 edges that solids shared parted", 2 * kCube_m3},
    BadMesh{"bad-face-to-face", true, face_to_face, "triangles that lie back to back dropped", 2 * kCube_m3},
    BadMesh{"bad-t-junction", true, t_junction, "(T-junctions)", kCube_m3},
    BadMesh{"bad-doubled", true, doubled_triangles, "30 doubled triangles dropped", kCube_m3},
    BadMesh{"bad-one-turned", true, one_turned, "1 triangles turned", kCube_m3},
    BadMesh{"bad-inside-out", true, turned_whole, "it faced inwards", kCube_m3},
    BadMesh{"bad-small-hole", true, small_hole, "1 holes closed", kCube_m3},
    BadMesh{"bad-open-box", false, open_box, "too large to close by guessing"},
    BadMesh{"bad-flat-sheet", false, flat_sheet, "too large to close by guessing"},
    BadMesh{"bad-moebius", false, moebius_strip, "only one side"},
};

}  // namespace

std::span<const BadMesh> bad_meshes() {
  return kAll;
}

}  // namespace farfeel::support
