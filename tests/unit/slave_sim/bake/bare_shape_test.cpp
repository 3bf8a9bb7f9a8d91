#include "slave_sim/bake/bare_shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "slave_sim/models/lattice_solid.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;

constexpr double kHalf_m = 0.010;

/// A cube in steps of 0.5 mm with bumps of 2.5 mm wavelength, 0.1 mm high, on every face.
TriangleMesh bumpy_cube(double height_m = 1e-4) {
  const LatticeSolid solid{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                           .steps = {{{40}, {40}, {40}}},
                           .is_solid = [](int, int, int) { return true; }};
  constexpr double k_1_per_m = 2 * std::numbers::pi / 0.0025;
  return skin(solid, [&](const LatticePoint& at) {
    const glm::dvec3 p = kHalf_m * at.p;
    return p + height_m * (std::sin(k_1_per_m * p.x) + std::sin(k_1_per_m * p.y) + std::sin(k_1_per_m * p.z)) *
                   at.outward();
  });
}

/// Root mean square distance from the cube without bumps, of the vertices 3 mm and more from its edges.
double rms_m(const TriangleMesh& mesh) {
  double square = 0, count = 0;
  for (const glm::dvec3& p : mesh.positions_O) {
    std::array<double, 3> off_m{std::abs(p.x), std::abs(p.y), std::abs(p.z)};
    std::sort(off_m.begin(), off_m.end());
    if (off_m[1] > kHalf_m - 0.003) continue;
    square += (off_m[2] - kHalf_m) * (off_m[2] - kHalf_m), ++count;
  }
  return std::sqrt(square / count);
}

TEST(BareShapeTest, BumpsGoAndEdgesStay) {
  const TriangleMesh rough = bumpy_cube(), bare = bare_shape(rough, 0.002);
  EXPECT_TRUE(geometry::is_closed_and_oriented(bare));
  EXPECT_LT(rms_m(bare), 0.3 * rms_m(rough));
  EXPECT_NEAR(geometry::signed_volume_m3(bare), geometry::signed_volume_m3(rough),
              0.01 * geometry::signed_volume_m3(rough));
  double corner_m = 0;
  for (const glm::dvec3& p : bare.positions_O) corner_m = std::max(corner_m, std::min({p.x, p.y, p.z}));
  EXPECT_GT(corner_m, kHalf_m - 3e-4) << "corners are not rounded off";
}

TEST(BareShapeTest, WhatHasNoReliefStaysWhereItIs) {
  const TriangleMesh smooth = bumpy_cube(0), bare = bare_shape(smooth, 0.002);
  for (std::size_t v = 0; v < smooth.positions_O.size(); ++v) {
    EXPECT_LT(glm::length(bare.positions_O[v] - smooth.positions_O[v]), 2e-5);
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
