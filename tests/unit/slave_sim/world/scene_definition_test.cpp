#include "slave_sim/world/scene_definition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

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

TEST(SceneDefinitionTest, ScalesAreOneUnlessTold) {
  const auto plain = parse_scene(kMinimal, "s.toml", "/base");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->workspace_scale, 1);
  EXPECT_EQ(plain->force_scale, 1);
  EXPECT_TRUE(plain->has_clutch);
  const auto scaled = parse_scene(
      "[workspace]\nscale = 2\nclutch = false\n[force]\nscale = 0.5\n" + std::string(kMinimal), "s.toml", "/base");
  ASSERT_TRUE(scaled) << scaled.error().message;
  EXPECT_EQ(scaled->workspace_scale, 2);
  EXPECT_EQ(scaled->force_scale, 0.5);
  EXPECT_FALSE(scaled->has_clutch);
}

TEST(SceneDefinitionTest, AMaterialIsTheAssetsUnlessTheSceneSaysOtherwise) {
  const auto scene = parse_scene(
      std::string(kMinimal) + "[object.material]\nstiffness_N_per_m = 800\ndynamic_friction = 0.9\n[tool.material]\n",
      "s.toml", "/base");
  ASSERT_TRUE(scene) << scene.error().message;
  const contact::Material asset{
      .stiffness_N_per_m = 2000, .damping_Ns_per_m = 0.7, .static_friction = 0.4, .dynamic_friction = 0.3};
  const contact::Material felt = scene->objects[0].material.over(asset);
  EXPECT_EQ(felt.stiffness_N_per_m, 800);
  EXPECT_EQ(felt.damping_Ns_per_m, 0.7);
  EXPECT_EQ(felt.dynamic_friction, 0.9);
  EXPECT_EQ(felt.static_friction, 0.9) << "static friction is never less than dynamic";
  EXPECT_EQ(MaterialOverride{.static_friction = 0.1}.over(asset).dynamic_friction, 0.1);
  EXPECT_EQ(scene->tool_material.over(asset).static_friction, 0.4);
  const std::string material = std::string(kMinimal) + "[object.material]\n";
  EXPECT_NE(complaint(material + "stiffness_N_per_m = 0\n").find("from 1 to 1000000"), std::string::npos);
  EXPECT_NE(complaint(material + "static_friction = 0.1\ndynamic_friction = 0.2\n").find("must not exceed"),
            std::string::npos);
}

TEST(SceneDefinitionTest, AnObjectMayMoveByAScript) {
  const auto scene = parse_scene(std::string(kMinimal) +
                                     "[object.motion]\nrepeats = true\nkey = [{},\n"
                                     "{at_s = 2, moved_m = [0.0, 0.02, 0.0], turned_deg = [0.0, 0.0, 90.0]},\n"
                                     "{at_s = 3}]\n",
                                 "s.toml", "/base");
  ASSERT_TRUE(scene) << scene.error().message;
  const ObjectDefinition& object = scene->objects[0];
  ASSERT_TRUE(object.motion);
  EXPECT_EQ(object.motion->afterwards(), motion::Afterwards::kRepeats);
  EXPECT_EQ(object.X_WM.p, glm::dvec3(0.1, 0, 0));
  const spatial::Pose turned = object.motion->at(5).X_WO;
  EXPECT_LT(glm::distance(turned.p, {0.1, 0.02, 0}), 1e-12) << "about the mesh's own origin";
  EXPECT_LT(glm::distance(spatial::rotate(turned, {1, 0, 0}), {-1, 0, 0}), 1e-9) << "a quarter more than it stood";
  EXPECT_FALSE(parse_scene(kMinimal, "s.toml", "/base")->objects[0].motion);
  const std::string motion = std::string(kMinimal) + "[object.motion]\n";
  EXPECT_NE(complaint(motion).find("two keys at least"), std::string::npos);
  EXPECT_NE(complaint(motion + "key = [{at_s = 1}, {at_s = 0.5}]\n").find("grow"), std::string::npos);
  EXPECT_NE(complaint(motion + "repeats = true\nkey = [{}, {at_s = 1, moved_m = [0, 1, 0]}]\n").find("repeats"),
            std::string::npos);
}

/// The keys after "allowed: " in what is said of an unknown key.
std::set<std::string> allowed_keys(const std::string& toml) {
  const std::string said = complaint(toml);
  std::set<std::string> keys;
  std::stringstream list(said.substr(said.find("allowed: ") + 9));
  for (std::string key; std::getline(list, key, ',');) keys.insert(key.substr(key.find_first_not_of(' ')));
  return keys;
}

TEST(SceneDefinitionTest, TheSchemaHasTheParsersKeysAndDefaults) {
  std::ifstream file(SCENE_SCHEMA);
  const auto schema = nlohmann::json::parse(file).at("properties");
  const auto keys = [](const nlohmann::json& properties) {
    std::set<std::string> names;
    for (const auto& [name, value] : properties.items()) names.insert(name);
    return names;
  };
  EXPECT_EQ(allowed_keys("zzzz = 1\n"), keys(schema));
  for (const std::string table : {"workspace", "force", "tool", "exploration"}) {
    EXPECT_EQ(allowed_keys("[" + table + "]\nzzzz = 1\n"), keys(schema.at(table).at("properties"))) << table;
  }
  EXPECT_EQ(allowed_keys("[[object]]\nzzzz = 1\n"), keys(schema.at("object").at("items").at("properties")));
  EXPECT_EQ(allowed_keys(std::string(kMinimal) + "[object.material]\nzzzz = 1\n"),
            keys(nlohmann::json::parse(std::ifstream(SCENE_SCHEMA)).at("$defs").at("material").at("properties")));
  const nlohmann::json& motion = schema.at("object").at("items").at("properties").at("motion").at("properties");
  EXPECT_EQ(allowed_keys(std::string(kMinimal) + "[object.motion]\nzzzz = 1\n"), keys(motion));
  EXPECT_EQ(allowed_keys(std::string(kMinimal) + "[[object.motion.key]]\nzzzz = 1\n"),
            keys(motion.at("key").at("items").at("properties")));

  const auto plain = parse_scene(std::string(kMinimal) + "[exploration]\n", "s.toml", "/base");
  ASSERT_TRUE(plain) << plain.error().message;
  EXPECT_EQ(schema.at("tolerance_m").at("default"), plain->tolerance_m);
  EXPECT_EQ(schema.at("grid_samples").at("default"), plain->grid_samples);
  EXPECT_EQ(schema.at("softness_m").at("default"), plain->softness_m);
  const nlohmann::json& exploration = schema.at("exploration").at("properties");
  EXPECT_EQ(exploration.at("press_force_N").at("default"), plain->exploration->press_force_N);
  EXPECT_EQ(exploration.at("stroke_speed_m_per_s").at("default"), plain->exploration->stroke_speed_m_per_s);
}

/// Earth-centred coordinates to a micrometre, of meshes and of the scene.
TEST(SceneDefinitionTest, AnOriginBringsASurveysCoordinatesIntoTheWorld) {
  const auto scene = parse_scene(
      "origin_m = [-2487002.5, -4684683.0, 3529638.0]\n[tool]\nmodel = \"file\"\n"
      "[[object]]\nmodel = \"cad\"\nposition_m = [-2487002.881739, -4684683.676571, 3529638.983984]\n"
      "[object.motion]\nkey = [{}, {at_s = 1, moved_m = [0.0, 0.0, 0.1]}]\n"
      "[exploration]\nregion_low_m = [-2487003.0, -4684684.0, 3529639.0]\n"
      "region_high_m = [-2487002.5, -4684683.5, 3529639.5]\n",
      "s.toml", "/base");
  ASSERT_TRUE(scene) << scene.error().message;
  const ObjectDefinition& object = scene->objects[0];
  EXPECT_LT(glm::distance(object.X_WM.p, {-0.381739, -0.676571, 0.983984}), 1e-8);
  EXPECT_LT(glm::distance(object.motion->at(1).X_WO.p, {-0.381739, -0.676571, 1.083984}), 1e-8);
  EXPECT_EQ(scene->exploration->region_low_W, glm::dvec3(-0.5, -1, 1));
  EXPECT_EQ(scene->exploration->region_high_W, glm::dvec3(0, -0.5, 1.5));
  EXPECT_FALSE(parse_scene(kMinimal, "s.toml", "/base")->origin_m) << "unsaid, the world may look for one";
}

TEST(SceneDefinitionTest, MakesASceneOfTwoAssets) {
  const SceneDefinition scene = scene_of("a/bunny.glb", "probe.glb");
  EXPECT_EQ(scene.name, "probe-bunny");
  EXPECT_EQ(scene.objects.at(0).source.asset, "a/bunny.glb");
  EXPECT_EQ(scene.tool.asset, "probe.glb");
  EXPECT_FALSE(scene.exploration);
}

TEST(SceneDefinitionTest, AWishNamesASceneAnObjectOrBoth) {
  const auto complaint_of = [](const SceneWish& wish) {
    const auto scene = wished_scene(wish);
    return scene ? "(accepted " + scene->name + ")" : scene.error().message;
  };
  EXPECT_EQ(complaint_of({}), "(accepted file-cad)");
  EXPECT_EQ(complaint_of({.object = "a.glb", .tool = "b.glb"}), "(accepted b-a)");
  EXPECT_EQ(complaint_of({.object = "a.glb"}), "(accepted scan-probe)");
  const auto scan = wished_scene({.scene = "scan-probe", .object = "dir/bunny.glb"});
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->objects[0].source.asset, "dir/bunny.glb");
  EXPECT_EQ(scan->objects[0].name, "bunny");
  EXPECT_EQ(scan->tool.model, "probe");
  EXPECT_NE(complaint_of({.scene = "scan-probe"}).find("farfeel bake"), std::string::npos);
  EXPECT_NE(complaint_of({.scene = "file-cad", .object = "a.glb"}).find("takes no --object"), std::string::npos);
  EXPECT_NE(complaint_of({.tool = "b.glb"}).find("goes with --object"), std::string::npos);
}

TEST(SceneDefinitionTest, EveryBenchmarkSceneOfTheDesignIsThere) {
  const std::vector<std::string> names = built_in_scene_names();
  for (const char* name : {"block-gear", "block-block", "hammer-torus", "file-cad", "torus-torus", "scan-probe"})
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
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
  EXPECT_NE(complaint(std::string(kMinimal) + "colour = 3\n").find("s.toml:8: unknown key colour in [object]"),
            std::string::npos);
  // The misspelt key explains more than what it leaves missing.
  EXPECT_NE(complaint("[tool]\nmodl = \"x\"\n").find("s.toml:2: unknown key modl in [tool], did you mean model?"),
            std::string::npos);
  EXPECT_NE(complaint("[tool]\nmodel = \"gaer\"\n[[object]]\nmodel = \"cad\"\n")
                .find("s.toml:2: tool.model is no built-in model, did you mean gear?; there are block"),
            std::string::npos);
  EXPECT_NE(complaint("[tol]\nmodel = \"x\"\n").find("s.toml:1: unknown key tol, did you mean tool?"),
            std::string::npos);
  EXPECT_NE(complaint("[force]\nscale = 1000\n" + std::string(kMinimal)).find("force.scale must be a number from 0.01"),
            std::string::npos);
  EXPECT_NE(
      complaint("[workspace]\nclutch = 1\n" + std::string(kMinimal)).find("workspace.clutch must be true or false"),
      std::string::npos);
  EXPECT_NE(complaint("tolerance_m = nan\n" + std::string(kMinimal)).find("tolerance_m must be a number"),
            std::string::npos);
  EXPECT_NE(complaint(std::string(kMinimal) + "[exploration]\napproach = [0,0,0]\n").find("must not be zero"),
            std::string::npos);
  EXPECT_NE(find_scene("no-such-scene").error().message.find("file-cad"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::slave_sim
