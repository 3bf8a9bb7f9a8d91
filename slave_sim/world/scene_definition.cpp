#include "slave_sim/world/scene_definition.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>

#include "slave_sim/world/built_in_scenes.h"

namespace farfeel::slave_sim {
namespace {

/// Thrown inside this file only; parse_scene turns it into a SceneError.
struct Fault {
  std::string message;
};

[[noreturn]] void fail(std::string_view origin, const toml::source_region& where, const std::string& what) {
  throw Fault{fmt::format("{}:{}: {}", origin, where.begin.line, what)};
}

/// One table of the file: hands out its keys, remembers which were asked for, and complains of the rest.
class Table {
 public:
  Table(const toml::table& table, std::string name, std::string_view origin)
      : table_(table), name_(std::move(name)), origin_(origin) {}

  std::optional<std::string> text(std::string_view key) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_string()) fail(origin_, node->source(), fmt::format("{} must be a string", path(key)));
    return node->value<std::string>();
  }

  double number(std::string_view key, double fallback, double low, double high) {
    const toml::node* node = find(key);
    if (node == nullptr) return fallback;
    const auto value = node->value<double>();
    if (!value || !(*value >= low && *value <= high)) {
      fail(origin_, node->source(), fmt::format("{} must be a number from {} to {}", path(key), low, high));
    }
    return *value;
  }

  glm::dvec3 vector(std::string_view key, const glm::dvec3& fallback, double limit = 100) {
    const toml::node* node = find(key);
    if (node == nullptr) return fallback;
    glm::dvec3 v;
    const toml::array* array = node->as_array();
    bool good = array != nullptr && array->size() == 3;
    for (std::size_t i = 0; good && i < 3; ++i) {
      const auto value = (*array)[i].value<double>();
      good = value && std::abs(*value) <= limit;
      if (good) v[static_cast<int>(i)] = *value;
    }
    if (!good) fail(origin_, node->source(), fmt::format("{} must be three numbers within +-{}", path(key), limit));
    return v;
  }

  glm::dvec3 direction(std::string_view key, const glm::dvec3& fallback) {
    const glm::dvec3 v = vector(key, fallback);
    if (!(glm::length(v) > 1e-6)) fail(origin_, table_.get(key)->source(), path(key) + " must not be zero");
    return glm::normalize(v);
  }

  const toml::table* table(std::string_view key) {
    const toml::node* node = find(key);
    if (node != nullptr && !node->is_table()) {
      fail(origin_, node->source(), fmt::format("{} must be a table, written [{}]", path(key), path(key)));
    }
    return node == nullptr ? nullptr : node->as_table();
  }

  const toml::array* tables(std::string_view key) {
    const toml::node* node = find(key);
    if (node != nullptr && !node->is_array_of_tables()) {
      fail(origin_, node->source(),
           fmt::format("{} must be a list of tables, each written [[{}]]", path(key), path(key)));
    }
    return node == nullptr ? nullptr : node->as_array();
  }

  [[noreturn]] void missing(const std::string& what) const { fail(origin_, table_.source(), what); }

  void expect_nothing_else() const {
    for (const auto& [key, node] : table_) {
      if (!asked_.contains(std::string(key.str()))) {
        fail(origin_, key.source(),
             fmt::format("{} is not a key here; allowed: {}", path(key.str()), fmt::join(asked_, ", ")));
      }
    }
  }

 private:
  const toml::node* find(std::string_view key) {
    asked_.emplace(key);
    return table_.get(key);
  }
  std::string path(std::string_view key) const {
    return name_.empty() ? std::string(key) : name_ + "." + std::string(key);
  }

  const toml::table& table_;
  std::string name_;
  std::string_view origin_;
  std::set<std::string> asked_;
};

AssetSource read_source(Table& table, const std::string& whose, const std::filesystem::path& base) {
  const auto model = table.text("model"), asset = table.text("asset");
  if (model.has_value() == asset.has_value()) {
    table.missing(whose + " needs either model = \"NAME\" or asset = \"FILE.glb\"");
  }
  if (model) return {*model, {}};
  const std::filesystem::path path(*asset);
  return {{}, path.is_absolute() ? path : base / path};
}

spatial::Pose read_pose(Table& table) {
  const glm::dvec3 p = table.vector("position_m", {0, 0, 0});
  const glm::dvec3 rotation_deg = table.vector("rotation_vector_deg", {0, 0, 0}, 180);
  return {spatial::rotation_from_vector(rotation_deg * (std::numbers::pi / 180)), p};
}

codecs::Exploration read_exploration(Table table) {
  codecs::Exploration e;
  e.p_TWork_T = table.vector("tool_point_m", e.p_TWork_T);
  e.nhat_work_T = table.direction("tool_normal", e.nhat_work_T);
  e.region_low_W = table.vector("region_low_m", e.region_low_W);
  e.region_high_W = table.vector("region_high_m", e.region_high_W);
  e.approach_W = table.direction("approach", e.approach_W);
  e.press_force_N = table.number("press_force_N", e.press_force_N, 0.01, 100);
  e.stroke_speed_m_per_s = table.number("stroke_speed_m_per_s", e.stroke_speed_m_per_s, 1e-4, 2);
  table.expect_nothing_else();
  if (glm::any(glm::lessThan(e.region_high_W, e.region_low_W))) {
    table.missing("exploration.region_low_m must not exceed region_high_m in any component");
  }
  return e;
}

SceneDefinition read_scene(Table table, std::string_view origin, const std::filesystem::path& base) {
  SceneDefinition scene;
  scene.name = std::filesystem::path(origin).stem().string();
  scene.title = table.text("title").value_or(scene.name);
  scene.tolerance_m = table.number("tolerance_m", scene.tolerance_m, 1e-6, 1);
  scene.grid_samples = static_cast<std::uint32_t>(table.number("grid_samples", scene.grid_samples, 4, 400));
  scene.softness_m = table.number("softness_m", scene.softness_m, 1e-8, 1e-2);
  const toml::table* tool = table.table("tool");
  if (tool == nullptr) table.missing("a scene needs a [tool]");
  Table tool_table(*tool, "tool", origin);
  scene.tool = read_source(tool_table, "[tool]", base);
  tool_table.expect_nothing_else();

  const toml::array* objects = table.tables("object");
  if (objects == nullptr) table.missing("a scene needs at least one [[object]]");
  for (const toml::node& node : *objects) {
    Table object(*node.as_table(), "object", origin);
    ObjectDefinition definition;
    definition.source = read_source(object, "an [[object]]", base);
    definition.name = object.text("name").value_or(definition.source.model);
    definition.X_WM = read_pose(object);
    object.expect_nothing_else();
    scene.objects.push_back(std::move(definition));
  }
  if (const toml::table* exploration = table.table("exploration")) {
    scene.exploration = read_exploration(Table(*exploration, "exploration", origin));
  }
  table.expect_nothing_else();
  return scene;
}

}  // namespace

tl::expected<SceneDefinition, SceneError> parse_scene(std::string_view toml, std::string_view origin,
                                                      const std::filesystem::path& base) {
  try {
    const toml::table root = toml::parse(toml, origin);
    return read_scene(Table(root, "", origin), origin, base);
  } catch (const toml::parse_error& error) {
    return tl::unexpected(
        SceneError{fmt::format("{}:{}: not TOML: {}", origin, error.source().begin.line, error.description())});
  } catch (const Fault& fault) {
    return tl::unexpected(SceneError{fault.message});
  }
}

tl::expected<SceneDefinition, SceneError> find_scene(std::string_view name_or_path) {
  for (const BuiltInScene& scene : kBuiltInScenes) {
    if (scene.name == name_or_path) return parse_scene(scene.toml, std::string(scene.name) + ".toml", {});
  }
  const std::filesystem::path path(name_or_path);
  std::ifstream file(path);
  if (!file) {
    return tl::unexpected(SceneError{fmt::format("no scene '{}': it is neither a readable file nor built in ({})",
                                                 name_or_path, fmt::join(built_in_scene_names(), ", "))});
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

std::vector<std::string> built_in_scene_names() {
  std::vector<std::string> names;
  for (const BuiltInScene& scene : kBuiltInScenes) names.emplace_back(scene.name);
  return names;
}

}  // namespace farfeel::slave_sim
