#include "haptic_core/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include "haptic_core/geometry/quartered.h"

namespace farfeel::geometry {
namespace {

TriangleMesh tetrahedron() {
  return {.positions_O = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

TEST(TriangleMeshTest, ATetrahedronIsClosedAndHasASixthOfItsCube) {
  EXPECT_TRUE(is_closed_and_oriented(tetrahedron()));
  EXPECT_DOUBLE_EQ(signed_volume_m3(tetrahedron()), 1.0 / 6);
  EXPECT_EQ(bounding_box(tetrahedron()).size(), glm::dvec3(1));
}

TEST(TriangleMeshTest, SeesHolesFlipsAndDoubledEdges) {
  TriangleMesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_FALSE(is_closed_and_oriented(open));
  TriangleMesh flipped = tetrahedron();
  std::swap(flipped.triangles[0][0], flipped.triangles[0][1]);
  EXPECT_FALSE(is_closed_and_oriented(flipped));
  TriangleMesh doubled = tetrahedron();
  doubled.triangles.push_back(doubled.triangles[0]);
  EXPECT_FALSE(is_closed_and_oriented(doubled));
}

TEST(TriangleMeshTest, QuarteredIsTheSameSurface) {
  const TriangleMesh whole = tetrahedron(), quarters = quartered(whole);
  EXPECT_EQ(quarters.triangles.size(), 4 * whole.triangles.size());
  EXPECT_EQ(quarters.positions_O.size(), whole.positions_O.size() + 6) << "a middle an edge";
  EXPECT_TRUE(is_closed_and_oriented(quarters));
  EXPECT_NEAR(signed_volume_m3(quarters), signed_volume_m3(whole), 1e-15);
  for (std::size_t i = 0; i < whole.positions_O.size(); ++i) EXPECT_EQ(quarters.positions_O[i], whole.positions_O[i]);
}

TEST(TriangleMeshTest, RoundsEveryCoordinateToFloat) {
  const glm::dvec3 p = rounded_to_float({0.1, -0.2, 0.3});
  EXPECT_EQ(p.x, static_cast<double>(0.1F));
  EXPECT_EQ(p.y, static_cast<double>(-0.2F));
  EXPECT_EQ(p.z, static_cast<double>(0.3F));
  EXPECT_EQ(rounded_to_float(p), p);
}

TEST(TriangleMeshTest, AnEmptyBoxSaysSo) {
  EXPECT_TRUE(Box().is_empty());
  EXPECT_EQ(unit_normal({.positions_O = {{0, 0, 0}, {1, 1, 1}}, .triangles = {}}, {0, 1, 1}), glm::dvec3(0));
}

}  // namespace
}  // namespace farfeel::geometry
