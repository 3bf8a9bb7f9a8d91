#include "slave_sim/world/world.h"

#include <gtest/gtest.h>

#include "slave_sim/bake/bake.h"
#include "slave_sim/models/lattice_solid.h"
#include "tests/support/private_folder.h"

namespace farfeel::slave_sim {
namespace {

constexpr glm::dvec3 kSurveyed_m{-2487002.5, -4684683.25, 3529638.75};

/// A cube of 40 mm with its middle there, as an asset in that file.
void bake_cube(const glm::dvec3& middle_M, const std::string& path) {
  const LatticeSolid cube{.cuts_m = {{{-0.02, 0.02}, {-0.02, 0.02}, {-0.02, 0.02}}},
                          .steps = {{{2}, {2}, {2}}},
                          .is_solid = [](int, int, int) { return true; }};
  const geometry::TriangleMesh mesh = skin(cube, [&](const LatticePoint& at) { return at.p + middle_M; });
  const auto baked = bake_asset("cube", mesh, {.coarse_triangles = 12, .texture = 64});
  ASSERT_TRUE(baked) << baked.error().message;
  ASSERT_TRUE(codecs::write_asset_file(baked->asset, path));
}

class WorldTest : public testing::Test {
 protected:
  /// A scene of the two cubes, the one at the origin first, with these lines before everything else.
  [[nodiscard]] tl::expected<World, SceneError> world(const std::string& lines, const std::string& of_object = {}) {
    bake_cube({0, 0, 0}, folder_.path() + "/near.glb");
    bake_cube(kSurveyed_m, folder_.path() + "/far.glb");
    return load_world(
        parse_scene(lines + "\n[tool]\nasset = \"near.glb\"\n[[object]]\nasset = \"far.glb\"\n" + of_object, "s.toml",
                    folder_.path())
            .value());
  }
  test_support::PrivateFolder folder_;
};

TEST_F(WorldTest, ASurveysPartStandsAtTheWorldsOriginAndIsToldOf) {
  const auto found = world("");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(glm::length(found->objects[0].X_WO.p), 1);
  EXPECT_LT(glm::distance(found->objects[0].X_WO.p + *found->definition.origin_m, kSurveyed_m), 1e-8);
  ASSERT_EQ(found->notes.size(), 1U);
  EXPECT_NE(found->notes[0].find("[-2487003, -4684683, 3529639] m"), std::string::npos) << found->notes[0];
  EXPECT_TRUE(codecs::write_scene(description_of(*found)));
}

TEST_F(WorldTest, AnOriginThatIsSaidIsKept) {
  const auto found = world("origin_m = [-2487000.0, -4684683.0, 3529638.0]");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(glm::distance(found->objects[0].X_WO.p, {-2.5, -0.25, 0.75}), 1e-8);
  EXPECT_TRUE(found->notes.empty());
  const auto wrong = world("origin_m = [0.0, 0.0, 0.0]");
  ASSERT_TRUE(wrong);
  const auto scene = codecs::write_scene(description_of(*wrong));
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("'far' stands more than 10 km from the world's origin"), std::string::npos)
      << scene.error().message;
}

TEST_F(WorldTest, WhatIsDrawnCoarselyFarOutIsTold) {
  const auto found = world("", "position_m = [2488002.5, 4684683.25, -3529638.75]\n");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->objects[0].X_WO.p.x, 1000, 1e-8);
  ASSERT_EQ(found->notes.size(), 1U);
  EXPECT_NE(found->notes[0].find("drawn in steps of 0.12 mm"), std::string::npos) << found->notes[0];
}

}  // namespace
}  // namespace farfeel::slave_sim
