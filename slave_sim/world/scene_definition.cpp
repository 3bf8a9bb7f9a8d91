#include "slave_sim/world/scene_definition.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <numbers>
#include <sstream>

#include "codecs/text/checked_table.h"
#include "codecs/text/nearest_word.h"
#include "slave_sim/models/models.h"
#include "slave_sim/world/built_in_scenes.h"

namespace farfeel::slave_sim {
namespace {

using codecs::CheckedTable;
using codecs::TableFault;

/// Of places in a file: the Earth's surface is 6.4e6 m from its centre.
constexpr double kMostSurveyed_m = 1e8;
constexpr std::string_view kGivenObject = "--object";  // as an asset: whatever the command line names

AssetSource read_source(CheckedTable& table, const std::filesystem::path& base) {
  const auto model = table.text("model"), asset = table.text("asset");
  if (model.has_value() == asset.has_value()) {
    table.fail("needs either model = \"NAME\" or asset = \"FILE.glb\"");
  }
  if (model && find_model(*model) == nullptr) {
    std::vector<std::string_view> names;
    for (const Model& each : models()) names.push_back(each.name);
    const std::string_view meant = codecs::nearest_word(*model, names);
    table.fail("model",
               fmt::format("is no built-in model{}; there are {}",
                           meant.empty() ? "" : fmt::format(", did you mean {}?", meant), fmt::join(names, ", ")));
  }
  if (model) return {*model, {}};
  if (*asset == kGivenObject) return {{}, {}};
  const std::filesystem::path path(*asset);
  return {{}, path.is_absolute() ? path : base / path};
}

glm::dquat turn_of(const CheckedTable& table, std::string_view key) {
  return spatial::rotation_from_vector(table.vector(key, {0, 0, 0}, 180) * (std::numbers::pi / 180));
}

spatial::Pose read_pose(CheckedTable& table) {
  const glm::dvec3 p = table.vector("position_m", {0, 0, 0}, kMostSurveyed_m);
  return {turn_of(table, "rotation_vector_deg"), p};
}

codecs::Exploration read_exploration(CheckedTable table) {
  codecs::Exploration e;
  e.p_TWork_T = table.vector("tool_point_m", e.p_TWork_T);
  e.nhat_work_T = table.direction("tool_normal", e.nhat_work_T);
  e.region_low_W = table.vector("region_low_m", e.region_low_W, kMostSurveyed_m);
  e.region_high_W = table.vector("region_high_m", e.region_high_W, kMostSurveyed_m);
  e.approach_W = table.direction("approach", e.approach_W);
  e.press_force_N = table.number("press_force_N", e.press_force_N, 0.01, 100);
  e.stroke_speed_m_per_s = table.number("stroke_speed_m_per_s", e.stroke_speed_m_per_s, 1e-4, 2);
  if (glm::any(glm::lessThan(e.region_high_W, e.region_low_W))) {
    table.fail("region_low_m must not exceed region_high_m in any component");
  }
  return e;
}

// The keys of every table; scene.schema.json says the same, and a test compares the two.
constexpr std::array<std::string_view, 13> kSceneKeys{
    "title",     "editable", "stamp_room_m", "origin_m", "tolerance_m", "grid_samples", "softness_m",
    "workspace", "force",    "tool",         "object",   "timeline",    "exploration"};
constexpr std::array<std::string_view, 2> kWorkspaceKeys{"scale", "clutch"};
constexpr std::array<std::string_view, 1> kForceKeys{"scale"};
constexpr std::array<std::string_view, 3> kToolKeys{"model", "asset", "material"};
constexpr std::array<std::string_view, 8> kObjectKeys{
    "name", "model", "asset", "position_m", "rotation_vector_deg", "material", "motion", "present"};
constexpr std::array<std::string_view, 9> kEditKeys{
    "at_s", "edit", "object", "place_m", "radius_m", "depth_m", "position_m", "rotation_vector_deg", "takes_s"};
constexpr std::array<std::string_view, 5> kEdits{"stamp", "spawn", "move", "remove", "revert"};  // as TimedEdit::Kind
constexpr std::array<std::string_view, 2> kMotionKeys{"repeats", "key"};
constexpr std::array<std::string_view, 3> kKeyframeKeys{"at_s", "moved_m", "turned_deg"};
constexpr std::array<std::string_view, 4> kMaterialKeys{"stiffness_N_per_m", "damping_Ns_per_m", "static_friction",
                                                        "dynamic_friction"};
constexpr std::array<std::string_view, 7> kExplorationKeys{"tool_point_m",        "tool_normal", "region_low_m",
                                                           "region_high_m",       "approach",    "press_force_N",
                                                           "stroke_speed_m_per_s"};
constexpr double kLeastScale = 0.01, kMostScale = 100;

MaterialOverride read_material(const CheckedTable& owner) {
  const auto table = owner.table("material", kMaterialKeys);
  if (!table) return {};
  MaterialOverride material{.stiffness_N_per_m = table->number("stiffness_N_per_m", 1, 1e6),
                            .damping_Ns_per_m = table->number("damping_Ns_per_m", 0, 1e3),
                            .static_friction = table->number("static_friction", 0, 10),
                            .dynamic_friction = table->number("dynamic_friction", 0, 10)};
  if (material.static_friction && material.dynamic_friction > material.static_friction)
    table->fail("dynamic_friction", "must not exceed static_friction");
  return material;
}

/// Keys say how far the object is from where it stands: turned about its mesh's origin, then moved.
std::optional<motion::ScriptedMotion> read_motion(const CheckedTable& object, const spatial::Pose& X_WM) {
  const auto table = object.table("motion", kMotionKeys);
  if (!table) return std::nullopt;
  std::vector<motion::Keyframe> keys;
  for (const CheckedTable& key : table->tables("key", kKeyframeKeys)) {
    keys.push_back({key.number("at_s", 0, 0, motion::kLongestScript_s),
                    {glm::normalize(turn_of(key, "turned_deg") * X_WM.R), X_WM.p + key.vector("moved_m", {0, 0, 0})}});
  }
  const auto then = table->flag("repeats", false) ? motion::Afterwards::kRepeats : motion::Afterwards::kStays;
  if (const auto fault = motion::fault_of(keys, then)) table->fail(*fault);
  return motion::ScriptedMotion(keys, then);
}

constexpr double kLeastMove_s = 0.05, kMostStamp_m = 0.1;

/// A key that belongs to other edits is misunderstood, not needless.
void refuse_keys(const CheckedTable& table, std::string_view edit, std::span<const std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (table.has(key)) table.fail(key, fmt::format("means nothing for a {}", edit));
  }
}

TimedEdit read_edit(CheckedTable table, std::vector<ObjectDefinition>& objects) {
  TimedEdit edit;
  edit.at_s = table.number("at_s", 0, 0, motion::kLongestScript_s);
  edit.kind = static_cast<TimedEdit::Kind>(table.choice("edit", 0, kEdits));
  const std::string name = table.text("object").value_or("");
  const auto object = std::ranges::find(objects, name, &ObjectDefinition::name);
  if (object == objects.end()) {
    std::vector<std::string_view> names;
    for (const ObjectDefinition& each : objects) names.push_back(each.name);
    table.fail("object", fmt::format("is none of the scene's objects, which are {}", fmt::join(names, ", ")));
  }
  edit.object = static_cast<std::uint32_t>(object - objects.begin());
  const std::string_view word = kEdits[static_cast<std::size_t>(edit.kind)];
  constexpr std::array<std::string_view, 3> kOfStamps{"place_m", "radius_m", "depth_m"};
  constexpr std::array<std::string_view, 2> kOfPoses{"position_m", "rotation_vector_deg"};
  constexpr std::array<std::string_view, 1> kOfMoves{"takes_s"};
  if (edit.kind == TimedEdit::Kind::kStamp) {
    refuse_keys(table, word, kOfPoses);
    refuse_keys(table, word, kOfMoves);
    edit.place_M = table.vector("place_m", {0, 0, 0});
    edit.radius_m = table.number("radius_m", 0.005, 1e-5, kMostStamp_m);
    edit.depth_m = table.number("depth_m", 0.0005, 1e-6, edit.radius_m);
    return edit;
  }
  refuse_keys(table, word, kOfStamps);
  if (edit.kind != TimedEdit::Kind::kMove) refuse_keys(table, word, kOfMoves);
  if (edit.kind == TimedEdit::Kind::kRemove || edit.kind == TimedEdit::Kind::kRevert)
    refuse_keys(table, word, kOfPoses);
  if (edit.kind == TimedEdit::Kind::kRevert && object->motion) return edit;  // its surface alone
  if (object->motion) table.fail("object", "moves by a script, and is not changed by anything else");
  object->may_change = true;
  if (table.has("position_m") || table.has("rotation_vector_deg")) edit.X_WM = read_pose(table);
  edit.takes_s =
      edit.kind == TimedEdit::Kind::kMove ? table.number("takes_s", 1, kLeastMove_s, motion::kLongestCourse_s) : 0;
  return edit;
}

SceneDefinition read_scene(CheckedTable table, std::string_view origin, const std::filesystem::path& base) {
  SceneDefinition scene;
  scene.name = std::filesystem::path(origin).stem().string();
  scene.title = table.text("title").value_or(scene.name);
  scene.tolerance_m = table.number("tolerance_m", scene.tolerance_m, 1e-6, 1);
  scene.grid_samples = static_cast<std::uint32_t>(table.number("grid_samples", scene.grid_samples, 4, 400));
  scene.softness_m = table.number("softness_m", scene.softness_m, 1e-8, 1e-2);
  if (auto workspace = table.table("workspace", kWorkspaceKeys)) {
    scene.workspace_scale = workspace->number("scale", scene.workspace_scale, kLeastScale, kMostScale);
    scene.has_clutch = workspace->flag("clutch", scene.has_clutch);
  }
  if (auto force = table.table("force", kForceKeys)) {
    scene.force_scale = force->number("scale", scene.force_scale, kLeastScale, kMostScale);
  }
  // Every table's keys are looked at before anything is found missing: a misspelt key is the better explanation.
  auto tool = table.table("tool", kToolKeys);
  std::vector<CheckedTable> objects = table.tables("object", kObjectKeys);
  const std::vector<CheckedTable> edits = table.tables("timeline", kEditKeys);
  if (auto exploration = table.table("exploration", kExplorationKeys)) {
    scene.exploration = read_exploration(*std::move(exploration));
  }
  if (!tool) table.fail("a scene needs a [tool]");
  scene.tool = read_source(*tool, base);
  scene.tool_material = read_material(*tool);
  if (scene.tool.is_given()) tool->fail("asset = \"--object\" is for objects");
  if (objects.empty()) table.fail("a scene needs at least one [[object]]");
  for (CheckedTable& object : objects) {
    ObjectDefinition definition;
    definition.source = read_source(object, base);
    const std::string fallback =
        definition.source.model.empty() ? definition.source.asset.stem().string() : definition.source.model;
    definition.name = object.text("name").value_or(fallback);
    definition.X_WM = read_pose(object);
    definition.material = read_material(object);
    definition.motion = read_motion(object, definition.X_WM);
    if (definition.motion) definition.X_WM = definition.motion->at(0).X_WO;
    definition.is_there = object.flag("present", true);
    definition.may_change = !definition.is_there;
    if (definition.motion && definition.may_change)
      object.fail("present", "cannot be false of what moves by a script: nothing could bring it");
    scene.objects.push_back(std::move(definition));
  }
  for (const CheckedTable& edit : edits) {
    scene.timeline.push_back(read_edit(edit, scene.objects));
    if (scene.timeline.size() > 1 && scene.timeline.back().at_s < scene.timeline[scene.timeline.size() - 2].at_s)
      edit.fail("at_s", "is before the edit's that stands above it");
  }
  scene.stamp_room_m = table.number("stamp_room_m", scene.stamp_room_m, 0, kMostStamp_m);
  if (table.flag("editable", false)) make_editable(scene);
  if (table.has("origin_m")) move_origin(scene, table.vector("origin_m", {}, kMostSurveyed_m));
  return scene;
}

}  // namespace

contact::Material MaterialOverride::over(contact::Material material) const {
  material.stiffness_N_per_m = stiffness_N_per_m.value_or(material.stiffness_N_per_m);
  material.damping_Ns_per_m = damping_Ns_per_m.value_or(material.damping_Ns_per_m);
  // One coefficient alone takes the other along: what slides more easily than it sticks stays so.
  material.static_friction = static_friction.value_or(std::max(material.static_friction, dynamic_friction.value_or(0)));
  material.dynamic_friction = dynamic_friction.value_or(std::min(material.dynamic_friction, material.static_friction));
  return material;
}

tl::expected<SceneDefinition, SceneError> parse_scene(std::string_view toml, std::string_view origin,
                                                      const std::filesystem::path& base) {
  try {
    const toml::table root = toml::parse(toml, origin);
    return read_scene(CheckedTable(root, "", origin, kSceneKeys), origin, base);
  } catch (const toml::parse_error& error) {
    return tl::unexpected(
        SceneError{fmt::format("{}:{}: not TOML: {}", origin, error.source().begin.line, error.description())});
  } catch (const TableFault& fault) {
    return tl::unexpected(SceneError{fault.message});
  }
}

void make_editable(SceneDefinition& scene) {
  scene.is_editable = true;
  for (ObjectDefinition& object : scene.objects) object.may_change = !object.motion;
}

void move_origin(SceneDefinition& scene, const glm::dvec3& to_m) {
  for (ObjectDefinition& object : scene.objects) {
    object.X_WM.p -= to_m;
    if (!object.motion) continue;
    std::vector<motion::Keyframe> keys(object.motion->keys().begin(), object.motion->keys().end());
    for (motion::Keyframe& key : keys) key.X_WO.p -= to_m;
    object.motion = motion::ScriptedMotion(keys, object.motion->afterwards());
  }
  for (TimedEdit& edit : scene.timeline) {
    if (edit.X_WM) edit.X_WM->p -= to_m;
  }
  if (scene.exploration) scene.exploration->region_low_W -= to_m, scene.exploration->region_high_W -= to_m;
  scene.origin_m = scene.origin_m.value_or(glm::dvec3(0)) + to_m;
}

tl::expected<SceneDefinition, SceneError> find_scene(std::string_view name_or_path) {
  for (const BuiltInScene& scene : kBuiltInScenes) {
    if (scene.name == name_or_path) return parse_scene(scene.toml, std::string(scene.name) + ".toml", {});
  }
  const std::filesystem::path path(name_or_path);
  std::ifstream file(path);
  if (!file) {
    const std::vector<std::string> names = built_in_scene_names();
    const std::string_view meant =
        codecs::nearest_word(name_or_path, std::vector<std::string_view>(names.begin(), names.end()));
    return tl::unexpected(
        SceneError{fmt::format("no scene '{}': it is neither a readable file nor built in ({}){}", name_or_path,
                               fmt::join(names, ", "), meant.empty() ? "" : fmt::format("; did you mean {}?", meant))});
  }
  std::stringstream text;
  text << file.rdbuf();
  return parse_scene(text.str(), path.string(), path.parent_path());
}

SceneDefinition scene_of(const std::filesystem::path& object, const std::filesystem::path& tool) {
  SceneDefinition scene;
  scene.name = fmt::format("{}-{}", tool.stem().string(), object.stem().string());
  scene.title = fmt::format("{} explored with {}", object.filename().string(), tool.filename().string());
  scene.tool.asset = tool;
  scene.objects.push_back({object.stem().string(), {{}, object}, {}});
  return scene;
}

tl::expected<SceneDefinition, SceneError> wished_scene(const SceneWish& wish) {
  if (!wish.tool.empty()) {
    if (wish.object.empty() || !wish.scene.empty())
      return tl::unexpected(SceneError{"--tool goes with --object and without --scene, for a scene of the two"});
    return scene_of(wish.object, wish.tool);
  }
  auto scene = find_scene(!wish.scene.empty() ? wish.scene : wish.object.empty() ? "file-cad" : "scan-probe");
  if (!scene) return scene;
  bool has_taken = false;
  for (ObjectDefinition& object : scene->objects) {
    if (!object.source.is_given()) continue;
    if (wish.object.empty()) {
      return tl::unexpected(SceneError{fmt::format(
          "scene {} explores an object of yours: bake one and name it,\n  farfeel bake bunny.obj --unit mm -o "
          "bunny.glb\n  farfeel loopback --scene {} --object bunny.glb",
          scene->name, scene->name)});
    }
    object.source.asset = wish.object;
    object.name = object.source.asset.stem().string();
    has_taken = true;
  }
  if (!wish.object.empty() && !has_taken) {
    return tl::unexpected(SceneError{fmt::format(
        "scene {} has its own objects and takes no --object; scan-probe does, or give --object and --tool without a "
        "scene",
        scene->name)});
  }
  return scene;
}

std::vector<std::string> built_in_scene_names() {
  std::vector<std::string> names;
  for (const BuiltInScene& scene : kBuiltInScenes) names.emplace_back(scene.name);
  return names;
}

}  // namespace farfeel::slave_sim
