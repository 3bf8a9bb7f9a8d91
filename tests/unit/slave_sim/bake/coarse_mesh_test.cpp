#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "slave_sim/bake/coarse_mesh.h"
#include "slave_sim/bake/edge_collapse.h"
#include "slave_sim/bake/full_surface.h"
#include "slave_sim/bake/mass.h"
#include "slave_sim/bake/self_crossing.h"
#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "tests/unit/slave_sim/bake/shells.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;

TriangleMesh box(const glm::dvec3& half_m, const glm::dvec3& centre_m) {
  const LatticeSolid solid{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                           .steps = {{{9}, {9}, {9}}},
                           .is_solid = [](int, int, int) { return true; }};
  return skin(solid, [&](const LatticePoint& at) { return centre_m + half_m * at.p; });
}

/// A square ring: one handle.
TriangleMesh ring() {
  const LatticeSolid solid{.cuts_m = {{{-0.03, -0.01, 0.01, 0.03}, {-0.03, -0.01, 0.01, 0.03}, {-0.01, 0.01}}},
                           .steps = {{{8, 8, 8}, {8, 8, 8}, {8}}},
                           .is_solid = [](int i, int j, int) { return i != 1 || j != 1; }};
  return skin(solid, [](const LatticePoint& at) { return at.p; });
}

int euler_characteristic(const TriangleMesh& mesh) {  // of a closed mesh: V - E + F
  return static_cast<int>(mesh.positions_O.size()) - static_cast<int>(mesh.triangles.size()) / 2;
}

TEST(MassTest, ABoxAwayFromTheOriginHasItsTextbookInertia) {
  const glm::dvec3 half(0.1, 0.2, 0.3), centre(5, -7, 11);
  const MassProperties m = mass_properties(box(half, centre), 1000);
  EXPECT_NEAR(m.mass_kg, 48, 1e-9);
  EXPECT_LT(glm::length(m.p_OCom_O - centre), 1e-12);
  EXPECT_NEAR(m.inertia_Com_kg_m2[0][0], 48.0 / 3 * (0.2 * 0.2 + 0.3 * 0.3), 1e-9);
  EXPECT_NEAR(m.inertia_Com_kg_m2[1][1], 48.0 / 3 * (0.1 * 0.1 + 0.3 * 0.3), 1e-9);
  EXPECT_NEAR(m.inertia_Com_kg_m2[2][2], 48.0 / 3 * (0.1 * 0.1 + 0.2 * 0.2), 1e-9);
  EXPECT_NEAR(m.inertia_Com_kg_m2[0][1], 0, 1e-9);
}

TEST(EdgeCollapseTest, ABoxLosesEverythingButItsShape) {
  const TriangleMesh full = box({0.01, 0.02, 0.03}, {1, 1, 1});
  const TriangleMesh coarse = edge_collapsed(full, 12);
  EXPECT_LE(coarse.triangles.size(), 14U);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_NEAR(geometry::signed_volume_m3(coarse), 8 * 6e-6, 1e-8);
}

/// Few triangles that are as few as they can be afterwards: nothing of a cube is relief.
TEST(CoarseMeshTest, ACubeOfFewTrianglesStaysACube) {
  for (const std::uint32_t squares : {2U, 3U, 4U, 6U}) {
    const LatticeSolid solid{.cuts_m = {{{-0.02, 0.02}, {-0.02, 0.02}, {-0.02, 0.02}}},
                             .steps = {{{squares}, {squares}, {squares}}},
                             .is_solid = [](int, int, int) { return true; }};
    const TriangleMesh full = skin(solid, [](const LatticePoint& at) { return at.p; });
    for (const std::uint32_t asked : {12U, 20U, 44U}) {
      const TriangleMesh coarse = coarse_mesh(full, asked);
      EXPECT_LE(coarse.triangles.size(), asked) << squares;
      EXPECT_NEAR(geometry::signed_volume_m3(coarse), 64e-6, 64e-9) << squares << " squares, " << asked << " asked";
    }
  }
}

TEST(EdgeCollapseTest, HandlesAndClosednessSurviveAnyTarget) {
  const TriangleMesh full = ring();
  ASSERT_EQ(euler_characteristic(full), 0);
  for (const std::uint32_t target : {2000U, 500U, 100U, 32U, 4U, 0U}) {
    const TriangleMesh coarse = edge_collapsed(full, target);
    EXPECT_TRUE(geometry::is_closed_and_oriented(coarse)) << target;
    EXPECT_EQ(euler_characteristic(coarse), 0) << target;
    EXPECT_GT(geometry::signed_volume_m3(coarse), 0) << target;
  }
}

TEST(EdgeCollapseTest, ASurfaceThatTouchesItselfInAVertexIsRefused) {
  TriangleMesh full = box({0.01, 0.01, 0.01}, {-0.01, -0.01, -0.01});
  const TriangleMesh other = box({0.01, 0.01, 0.01}, {0.01, 0.01, 0.01});
  const auto corner_of = [](const TriangleMesh& mesh) {
    return static_cast<std::uint32_t>(
        std::min_element(mesh.positions_O.begin(), mesh.positions_O.end(),
                         [](const auto& a, const auto& b) { return glm::length(a) < glm::length(b); }) -
        mesh.positions_O.begin());
  };
  const std::uint32_t shared = corner_of(full), merged = corner_of(other);
  const auto first = static_cast<std::uint32_t>(full.positions_O.size());
  full.positions_O.insert(full.positions_O.end(), other.positions_O.begin(), other.positions_O.end());
  for (geometry::Triangle t : other.triangles) {
    for (std::uint32_t& v : t) v = v == merged ? shared : first + v;
    full.triangles.push_back(t);
  }
  ASSERT_TRUE(geometry::is_closed_and_oriented(full));
  EXPECT_TRUE(edge_collapsed(full, 100).triangles.empty());
}

/// Every triangle of the caps is a sliver, and every vertex of the sides touches one.
TEST(EdgeCollapseTest, FansOfSliversAreSimplifiedToo) {
  for (const std::uint32_t sides : {720U, 3000U}) {
    const TriangleMesh full = support::cylinder_mesh(0.02, 0.04, sides), coarse = edge_collapsed(full, 300);
    EXPECT_LE(coarse.triangles.size(), 300U) << sides;
    EXPECT_TRUE(geometry::is_closed_and_oriented(coarse)) << sides;
    EXPECT_NEAR(geometry::signed_volume_m3(coarse), geometry::signed_volume_m3(full),
                2e-3 * geometry::signed_volume_m3(full));
    EXPECT_EQ(self_crossing(coarse).edges, 0U) << sides;
  }
}

/// Rings of slivers between a hub and a rim of 60 ridges: a ring's vertices go along it one by one, and each lets the
/// slivers beside it lean a little.
TEST(EdgeCollapseTest, RingsOfSliversInsideARidgedRimAreSimplifiedToo) {
  for (const std::uint32_t sides : {1280U, 3000U}) {
    const auto drum = [](std::uint32_t row, double theta) {
      constexpr double kShares[] = {0.33, 0.67, 1, 1, 1, 0.67, 0.33};
      return support::ProfilePoint{kShares[row] * (0.06 - 0.00075 * (1 - std::cos(60 * theta))),
                                   0.015 * std::clamp(static_cast<int>(row) - 3, -1, 1)};
    };
    const TriangleMesh full = support::turned_mesh({.sides = sides, .rows = 7, .is_ring = false, .profile = drum});
    const TriangleMesh coarse = edge_collapsed(full, 700);
    EXPECT_LE(coarse.triangles.size(), 700U) << sides;
    EXPECT_TRUE(geometry::is_closed_and_oriented(coarse)) << sides;
    EXPECT_NEAR(geometry::signed_volume_m3(coarse), geometry::signed_volume_m3(full),
                5e-3 * geometry::signed_volume_m3(full));
    EXPECT_EQ(self_crossing(coarse).edges, 0U) << sides;
  }
}

/// A turned part as CAD programs write it: waves along its axis, caps that are fans of 720 slivers.
TEST(CoarseMeshTest, OfATurnedPartOf79200TrianglesHasAboutAsManyAsAsked) {
  constexpr std::uint32_t kSides = 720, kRows = 55;
  const TriangleMesh full = support::turned_mesh(
      {.sides = kSides, .rows = kRows, .is_ring = false, .profile = [](std::uint32_t row, double) {
         const double along = static_cast<double>(row) / (kRows - 1);
         return support::ProfilePoint{0.012 + 0.004 * std::sin(6 * std::numbers::pi * along), 0.08 * along};
       }});
  ASSERT_EQ(full.triangles.size(), 79'200U);
  const TriangleMesh coarse = coarse_mesh(full, 700);
  EXPECT_LE(coarse.triangles.size(), 800U);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_NEAR(geometry::signed_volume_m3(coarse), geometry::signed_volume_m3(full),
              1e-2 * geometry::signed_volume_m3(full));
}

/// A ball with poles: a fan of so many sides at each.
TEST(EdgeCollapseTest, PolesOfABallAreSimplifiedToo) {
  constexpr std::uint32_t kSides = 900, kRows = 60;
  const TriangleMesh full =
      support::turned_mesh({.sides = kSides, .rows = kRows, .is_ring = false, .profile = [](std::uint32_t row, double) {
                              const double angle = std::numbers::pi * (row + 0.05) / (kRows - 0.9);
                              return support::ProfilePoint{0.02 * std::sin(angle), -0.02 * std::cos(angle)};
                            }});
  const TriangleMesh coarse = edge_collapsed(full, 700);
  EXPECT_LE(coarse.triangles.size(), 700U);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_NEAR(geometry::signed_volume_m3(coarse), geometry::signed_volume_m3(full),
              1e-2 * geometry::signed_volume_m3(full));
}

TEST(EdgeCollapseTest, TheCoarseSurfaceRunsThroughTheMiddleOfFineRidges) {
  const TriangleMesh coarse = edge_collapsed(block_mesh(), 400);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_NEAR(geometry::signed_volume_m3(coarse), geometry::signed_volume_m3(block_mesh()), 3e-6);
}

/// How far points of a shell (its corners and middles) are from `coarse` at most. The rim, where a wall ends, may draw
/// back.
double worst_off_walls_m(const TriangleMesh& shell, const TriangleMesh& coarse) {
  constexpr double kNoRim_rad = 1.0;
  const FullSurface surface(coarse);
  double worst_m = 0;
  for (const geometry::Triangle& t : shell.triangles) {
    const glm::dvec3 &a = shell.positions_O[t[0]], &b = shell.positions_O[t[1]], &c = shell.positions_O[t[2]];
    for (const glm::dvec3& p : {a, (a + b + c) / 3.0}) {
      if (-p.z > std::cos(kNoRim_rad) * glm::length(p)) worst_m = std::max(worst_m, surface.distance_m(p));
    }
  }
  return worst_m;
}

TEST(CoarseMeshTest, ThinWallsKeepTwoSidesAndThickOnesTheirBudget) {
  constexpr std::uint32_t kAim = 120;
  const TriangleMesh thin = shell_mesh(0.06, 0.001, 1.2, 40, 96), thick = shell_mesh(0.06, 0.03, 1.2, 40, 96);
  EXPECT_LE(coarse_mesh(thick, kAim).triangles.size(), kAim);
  const TriangleMesh coarse = coarse_mesh(thin, kAim);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_GT(coarse.triangles.size(), kAim);
  EXPECT_LE(worst_off_walls_m(thin, coarse), 0.5e-3);  // a quarter of a millimetre by each of two steps
  EXPECT_EQ(self_crossing(coarse).edges, 0U);
  // Without the bound the same aim runs right through the wall.
  EXPECT_GT(worst_off_walls_m(thin, edge_collapsed(thin, kAim)), 1e-3);
}

/// How far corners of a shell's rims, at z = 0, are from the nearest edge of `coarse` at most.
double worst_off_rims_m(const TriangleMesh& shell, const TriangleMesh& coarse) {
  double worst_m = 0;
  for (const glm::dvec3& p : shell.positions_O) {
    if (std::abs(p.z) > 1e-6) continue;
    double least_m = std::numeric_limits<double>::infinity();
    for (const geometry::Triangle& t : coarse.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 a = coarse.positions_O[t[k]], side = coarse.positions_O[t[(k + 1) % 3]] - a;
        const double share = std::clamp(glm::dot(p - a, side) / glm::dot(side, side), 0.0, 1.0);
        least_m = std::min(least_m, glm::length(a + share * side - p));
      }
    }
    worst_m = std::max(worst_m, least_m);
  }
  return worst_m;
}

TEST(CoarseMeshTest, SmoothRimsStayWhereTheyAre) {
  constexpr std::uint32_t kAim = 700;
  const TriangleMesh shell = shell_mesh(0.06, 0.003, 0.5 * std::numbers::pi, 48, 96);
  const TriangleMesh coarse = coarse_mesh(shell, kAim);
  EXPECT_TRUE(geometry::is_closed_and_oriented(coarse));
  EXPECT_LE(coarse.triangles.size(), kAim * 3 / 2);
  EXPECT_LE(worst_off_rims_m(shell, coarse), 0.15e-3);  // 0.075 mm by each of two steps
  EXPECT_GT(worst_off_rims_m(shell, edge_collapsed(shell, kAim)), 0.2e-3);
}

TEST(CoarseMeshTest, WithoutThinMaterialTheBoundChangesNothing) {
  const TriangleMesh mesh = ring();
  const std::vector<double> free(mesh.positions_O.size(), std::numeric_limits<double>::infinity());
  const std::vector<double> wide(mesh.positions_O.size(), 0.02);
  const TriangleMesh plain = edge_collapsed(mesh, 100);
  for (const auto* most_off_m : {&free, &wide}) {
    const TriangleMesh held = edge_collapsed(mesh, 100, *most_off_m);
    EXPECT_EQ(held.triangles, plain.triangles);
    EXPECT_EQ(held.positions_O, plain.positions_O);
  }
}

}  // namespace
}  // namespace farfeel::slave_sim
