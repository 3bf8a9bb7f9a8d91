#include "slave_sim/world/scene_definition.h"

#include <gtest/gtest.h>

#include <numbers>

namespace farfeel::slave_sim {
namespace {

constexpr const char* kMinimal = R"(
[tool]
model = "file"
[[object]]
asset = "parts/a.glb"
position_m = [0.1, 0, 0]
rotation_vector_deg = [0, 0, 90]
)";

std::string complaint(std::string_view toml) {
  const auto scene = parse_scene(toml, "s.toml", "/base");
  return scene ? "(accepted)" : scene.error().message;
}

TEST(SceneDefinitionTest, ReadsAScene) {
  const auto scene = parse_scene(kMinimal, "dir/s.toml", "/base");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->name, "s");
  EXPECT_EQ(scene->tool.model, "file");
  ASSERT_EQ(scene->objects.size(), 1u);
  EXPECT_EQ(scene->objects[0].source.asset, "/base/parts/a.glb");
  EXPECT_EQ(scene->objects[0].X_WM.p, glm::dvec3(0.1, 0, 0));
  EXPECT_NEAR(spatial::vector_from_rotation(scene->objects[0].X_WM.R).z, std::numbers::pi / 2, 1e-12);
}

TEST(SceneDefinitionTest, MakesASceneOfTwoAssets) {
  const SceneDefinition scene = scene_of("a/bunny.glb", "probe.glb");
  EXPECT_EQ(scene.name, "probe-bunny");
  EXPECT_EQ(scene.objects.at(0).source.asset, "a/bunny.glb");
  EXPECT_EQ(scene.tool.asset, "probe.glb");
  EXPECT_FALSE(scene.exploration);
}

TEST(SceneDefinitionTest, EveryBuiltInSceneIsValid) {
  ASSERT_FALSE(built_in_scene_names().empty());
  for (const std::string& name : built_in_scene_names()) {
    const auto scene = find_scene(name);
    EXPECT_TRUE(scene) << scene.error().message;
    if (scene) {
      EXPECT_EQ(scene->name, name);
    }
  }
}

TEST(SceneDefinitionTest, SaysWhatIsWrongAndWhere) {
  EXPECT_NE(complaint("[tool\n").find("s.toml:1: not TOML:"), std::string::npos);
  EXPECT_NE(complaint("title = 3\n").find("s.toml:1: title must be a string"), std::string::npos);
  EXPECT_NE(complaint("[[object]]\nmodel = \"cad\"\n").find("needs a [tool]"), std::string::npos);
  EXPECT_NE(complaint("[tool]\nmodel = \"file\"\n").find("at least one [[object]]"), std::string::npos);
  EXPECT_NE(complaint("[tool]\nmodel = \"a\"\nasset = \"b\"\n").find("either model"), std::string::npos);
  EXPECT_NE(complaint(std::string(kMinimal) + "colour = 3\n").find("s.toml:8: object.colour is not a key here"),
            std::string::npos);
  EXPECT_NE(complaint("tolerance_m = nan\n" + std::string(kMinimal)).find("tolerance_m must be a number"),
            std::string::npos);
  EXPECT_NE(complaint(std::string(kMinimal) + "[exploration]\napproach = [0,0,0]\n").find("must not be zero"),
            std::string::npos);
  EXPECT_NE(find_scene("no-such-scene").error().message.find("file-cad"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::slave_sim
