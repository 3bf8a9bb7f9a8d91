// The skin of a box on a 224 x 36 x 32 lattice: 2 (224*36 + 36*32 + 32*224) squares, 65,536 triangles. z runs linearly
// between the two ridged faces, so the sides close against them.
#include <cmath>
#include <numbers>

#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

constexpr glm::dvec3 kHalf_m{0.040, 0.040, 0.020};
constexpr double kPeriod_m = 0.006, kDepth_m = 0.0015;
// The base's faces stand this share of the ridges' depth below the crests. The sides end there, where the true ones end
// in a wave: deeper, less of the sides is felt that is not there above the valleys, and more is missing below the
// crests.
constexpr double kBaseDepth = 0.62;

double ridge_top_m(double x_m) {
  return kHalf_m.z - 0.5 * kDepth_m * (1 - std::cos(2 * std::numbers::pi * x_m / kPeriod_m));
}

}  // namespace

geometry::TriangleMesh block_mesh() {
  const LatticeSolid box{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                         .steps = {{{224}, {36}, {32}}},
                         .is_solid = [](int, int, int) { return true; }};
  return skin(box, [](const LatticePoint& at) {
    const double x_m = kHalf_m.x * at.p.x;
    return glm::dvec3(x_m, kHalf_m.y * at.p.y, ridge_top_m(x_m) * at.p.z);
  });
}

geometry::TriangleMesh block_base() {
  const double z_m = kHalf_m.z - kBaseDepth * kDepth_m;
  const LatticeSolid box{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                         .steps = {{{1}, {1}, {1}}},
                         .is_solid = [](int, int, int) { return true; }};
  geometry::TriangleMesh mesh =
      skin(box, [&](const LatticePoint& at) { return at.p * glm::dvec3(kHalf_m.x, kHalf_m.y, z_m); });
  // Twelve triangles; a vertex in the middle of either ridged face makes them sixteen.
  for (const double side : {-1.0, 1.0}) {
    const auto centre = static_cast<std::uint32_t>(mesh.positions_O.size());
    mesh.positions_O.emplace_back(0, 0, side * z_m);
    std::vector<geometry::Triangle> kept;
    for (const geometry::Triangle& t : mesh.triangles) {
      if (geometry::unit_normal(mesh, t).z * side < 0.5) {
        kept.push_back(t);
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i) {  // keep the square's four sides, drop its diagonal
        const std::uint32_t from = t[i], to = t[(i + 1) % 3];
        const glm::dvec3 along = mesh.positions_O[to] - mesh.positions_O[from];
        if (along.x == 0 || along.y == 0) kept.push_back({from, to, centre});
      }
    }
    mesh.triangles = kept;
  }
  return mesh;
}

}  // namespace farfeel::slave_sim
