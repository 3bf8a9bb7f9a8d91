#include "slave_sim/world/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "slave_sim/world/exploration.h"

namespace farfeel::slave_sim {
namespace {

tl::expected<codecs::Asset, SceneError> load(const AssetSource& source, const Progress& progress,
                                             std::vector<std::string>& notes) {
  if (source.is_given()) {
    return tl::unexpected(SceneError{"the scene leaves its object to be given: name an asset with --object"});
  }
  if (!source.model.empty()) {
    const auto note_once = [&notes](const std::string& line) {
      if (std::find(notes.begin(), notes.end(), line) == notes.end()) notes.push_back(line);
    };
    auto baked = cached_model_asset(source.model, asset_cache_folder(), progress, note_once);
    if (!baked) return tl::unexpected(SceneError{fmt::format("model '{}': {}", source.model, baked.error().message)});
    return *std::move(baked);
  }
  auto read = codecs::read_asset_file(source.asset);
  if (!read) return tl::unexpected(SceneError{read.error().message});
  return *std::move(read);
}

/// A motion of the mesh's own frame M, as one of O.
std::optional<motion::ScriptedMotion> of_origin(const std::optional<motion::ScriptedMotion>& of_M,
                                                const spatial::Pose& X_MO) {
  if (!of_M) return std::nullopt;
  std::vector<motion::Keyframe> keys(of_M->keys().begin(), of_M->keys().end());
  for (motion::Keyframe& key : keys) key.X_WO = key.X_WO * X_MO;
  return motion::ScriptedMotion(keys, of_M->afterwards());
}

bool is_far(const spatial::Pose& X_WO) {
  return glm::any(glm::greaterThan(glm::abs(X_WO.p), glm::dvec3(codecs::kMaxPlace_m)));
}

void place(World& world) {
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    const ObjectDefinition& object = world.definition.objects[i];
    const spatial::Pose X_MO{{1, 0, 0, 0}, -world.objects[i].asset.p_OM_O};
    world.objects[i].X_WO = object.X_WM * X_MO;
    world.objects[i].motion = of_origin(object.motion, X_MO);
  }
}

/// Live views and pictures are drawn from 32-bit numbers of W; what is felt is not.
void tell_of_steps(World& world) {
  constexpr double kSeen_m = 5e-5;
  for (const WorldObject& object : world.objects) {
    const glm::dvec3 at_m = glm::abs(object.X_WO.p);
    const double far_m = std::max({at_m.x, at_m.y, at_m.z}), step_m = far_m * std::numeric_limits<float>::epsilon();
    if (step_m > kSeen_m)
      world.notes.push_back(fmt::format(
          "object '{}' stands {:.0f} m from the world's origin: it is drawn in steps of {:.2g} mm there, and felt as "
          "it is; origin_m in the scene brings the origin to it",
          object.name, far_m, 1e3 * step_m));
  }
}

}  // namespace

tl::expected<World, SceneError> load_world(SceneDefinition definition, const Progress& progress) {
  World world;
  auto tool = load(definition.tool, progress, world.notes);
  if (!tool) return tl::unexpected(tool.error());
  world.tool = *std::move(tool);
  world.tool.material = definition.tool_material.over(world.tool.material);
  for (const ObjectDefinition& object : definition.objects) {
    auto asset = load(object.source, progress, world.notes);
    if (!asset) return tl::unexpected(asset.error());
    asset->material = object.material.over(asset->material);
    world.objects.push_back({object.name, *std::move(asset), {}, {}, object.may_change, object.is_there});
  }
  world.definition = std::move(definition);
  place(world);
  const bool is_any_far = std::any_of(world.objects.begin(), world.objects.end(),
                                      [](const WorldObject& object) { return is_far(object.X_WO); });
  if (is_any_far && !world.definition.origin_m) {
    const glm::dvec3 to_m = glm::round(world.objects.front().X_WO.p);
    move_origin(world.definition, to_m);
    place(world);
    world.notes.push_back(
        fmt::format("the world's origin is at [{:.0f}, {:.0f}, {:.0f}] m of the scene's coordinates, "
                    "where '{}' stands; origin_m in the scene says otherwise",
                    to_m.x, to_m.y, to_m.z, world.objects.front().name));
  }
  tell_of_steps(world);
  return world;
}

codecs::SceneDescription description_of(const World& world) {
  codecs::SceneDescription description;
  description.name = world.definition.name;
  for (const WorldObject& object : world.objects) {
    description.objects.push_back({object.name, object.X_WO, object.asset.visible, object.motion, object.may_change,
                                   object.is_there, object.asset.visible_colours});
  }
  description.tool = {world.tool.name,     world.tool.visible,        world.tool.mass_kg, world.tool.inertia_O_kg_m2,
                      world.tool.material, world.tool.visible_colours};
  if (world.definition.exploration) {
    description.exploration = *world.definition.exploration;
    description.exploration.p_TWork_T += world.tool.p_OM_O;
  } else {
    const WorldObject& first = world.objects.front();
    description.exploration = exploration_from_above(first.asset, first.X_WO, world.tool);
  }
  description.tolerance_m = world.definition.tolerance_m;
  description.workspace_scale = world.definition.workspace_scale;
  description.force_scale = world.definition.force_scale;
  description.has_clutch = world.definition.has_clutch;
  return description;
}

}  // namespace farfeel::slave_sim
