#include "slave_sim/world/exploration.h"

#include <gtest/gtest.h>

namespace farfeel::slave_sim {
namespace {

/// The faces of a box with corners low and high that face up or down.
void add_plates(geometry::TriangleMesh& mesh, const glm::dvec3& low, const glm::dvec3& high) {
  for (const double z : {low.z, high.z}) {
    const auto first = static_cast<std::uint32_t>(mesh.positions_O.size());
    for (const auto& [x, y] : {std::pair{low.x, low.y}, {high.x, low.y}, {high.x, high.y}, {low.x, high.y}})
      mesh.positions_O.emplace_back(x, y, z);
    const bool is_top = z == high.z;
    mesh.triangles.push_back({first, is_top ? first + 1 : first + 2, is_top ? first + 2 : first + 1});
    mesh.triangles.push_back({first, is_top ? first + 2 : first + 3, is_top ? first + 3 : first + 2});
  }
}

TEST(ExplorationTest, PrefersABroadLevelPlaceToAHighSpike) {
  codecs::Asset object, tool;
  add_plates(object.felt.coarse, {-0.05, -0.05, -0.01}, {0.05, 0.05, 0});
  add_plates(object.felt.coarse, {0.040, 0.040, 0}, {0.044, 0.044, 0.08});  // the spike
  add_plates(tool.felt.coarse, {-0.001, -0.001, -0.003}, {0.001, 0.001, 0.003});
  const spatial::Pose X_WO{{1, 0, 0, 0}, {1, 2, 3}};
  const codecs::Exploration e = exploration_from_above(object, X_WO, tool);
  EXPECT_NEAR(e.region_low_W.z, 3, 1e-9);
  EXPECT_NEAR(e.region_high_W.z, 3, 1e-9);
  for (int axis = 0; axis < 2; ++axis) {  // the whole region lies on the plate
    EXPECT_GT(e.region_low_W[axis], X_WO.p[axis] - 0.05);
    EXPECT_LT(e.region_high_W[axis], X_WO.p[axis] + 0.05);
    EXPECT_GT(e.region_high_W[axis] - e.region_low_W[axis], 0.005);
  }
  EXPECT_EQ(e.p_TWork_T.z, -0.003);
}

TEST(ExplorationTest, FindsTheHighestPointWhereNothingIsLevel) {
  codecs::Asset object, tool;
  object.felt.coarse.positions_O = {{0, 0, 0}, {0.01, 0, 0.05}, {0, 0.01, 0}};
  object.felt.coarse.triangles = {{0, 1, 2}};
  tool.felt.coarse = object.felt.coarse;
  EXPECT_EQ(exploration_from_above(object, {}, tool).region_high_W.z, 0.05);
}

}  // namespace
}  // namespace farfeel::slave_sim
