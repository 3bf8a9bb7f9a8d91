#include "haptic_core/geometry/piece_thickness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/solids.h"

namespace farfeel::geometry {
namespace {

/// Every triangle a piece.
HapticSurface facets(const TriangleMesh& mesh) {
  HapticSurface surface;
  surface.coarse = mesh;
  surface.piece_count = static_cast<std::uint32_t>(mesh.triangles.size());
  for (std::uint32_t t = 0; t < surface.piece_count; ++t) surface.triangle_piece.push_back(t);
  surface.triangle_chart.assign(mesh.triangles.size(), kNoChart);
  return surface;
}

TEST(PieceThicknessTest, ABoxIsAsThickAsItsSides) {
  const glm::dvec3 size(0.03, 0.02, 0.005);
  const HapticSurface box = facets(support::box_mesh(size));
  const std::vector<double> thickness_m = measured_thickness_m(box);
  for (std::size_t t = 0; t < box.coarse.triangles.size(); ++t) {
    const glm::dvec3 n = glm::abs(unit_normal(box.coarse, box.coarse.triangles[t]));
    EXPECT_NEAR(thickness_m[t], glm::dot(n, size), 1e-8);
  }
}

TEST(PieceThicknessTest, ATubesWallIsAsThickAsItIs) {
  const HapticSurface tube = facets(support::tube_mesh(0.02, 0.023, 0.05, 96));
  const std::vector<double> thickness_m = measured_thickness_m(tube);
  for (std::size_t t = 0; t < tube.coarse.triangles.size(); ++t) {
    const glm::dvec3 n = unit_normal(tube.coarse, tube.coarse.triangles[t]);
    const bool is_end = std::abs(n.z) > 0.5;
    EXPECT_NEAR(thickness_m[t], is_end ? 0.05 : 0.003, is_end ? 1e-8 : 3e-5);  // 96 sides
  }
}

TEST(PieceThicknessTest, APieceHasItsLeastAndWhatHasNoOtherSideIsUnknown) {
  HapticSurface box = facets(support::box_mesh({0.03, 0.02, 0.005}));
  box.piece_count = 1;
  std::fill(box.triangle_piece.begin(), box.triangle_piece.end(), 0);
  ASSERT_EQ(measured_thickness_m(box).size(), 1U);
  EXPECT_NEAR(measured_thickness_m(box)[0], 0.005, 1e-9);
  EXPECT_EQ(piece_thickness_m(box), measured_thickness_m(box));
  box.piece_thickness_m = {0.001};
  EXPECT_EQ(piece_thickness_m(box), std::vector{0.001});
  EXPECT_TRUE(faults(box).empty());
  const HapticSurface sheet = facets({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  EXPECT_EQ(measured_thickness_m(sheet), std::vector{0.0});
}

TEST(PieceThicknessTest, FaultsAreTold) {
  for (const std::vector<double>& wrong :
       {std::vector{0.1, 0.1}, std::vector{-1e-3}, std::vector{0.2}, std::vector{std::nan("")}}) {
    HapticSurface box = facets(support::box_mesh({0.03, 0.02, 0.005}));
    box.piece_count = 1;
    std::fill(box.triangle_piece.begin(), box.triangle_piece.end(), 0);
    box.piece_thickness_m = wrong;
    EXPECT_FALSE(faults(box).empty());
  }
}

}  // namespace
}  // namespace farfeel::geometry
