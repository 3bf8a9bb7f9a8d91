#include "slave_sim/world/world.h"

#include <fmt/format.h>

#include "slave_sim/world/exploration.h"

namespace farfeel::slave_sim {
namespace {

tl::expected<codecs::Asset, SceneError> load(const AssetSource& source, const Progress& progress) {
  if (source.is_given()) {
    return tl::unexpected(SceneError{"the scene leaves its object to be given: name an asset with --object"});
  }
  if (!source.model.empty()) {
    auto baked = cached_model_asset(source.model, asset_cache_folder(), progress);
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

}  // namespace

tl::expected<World, SceneError> load_world(SceneDefinition definition, const Progress& progress) {
  World world;
  auto tool = load(definition.tool, progress);
  if (!tool) return tl::unexpected(tool.error());
  world.tool = *std::move(tool);
  world.tool.material = definition.tool_material.over(world.tool.material);
  for (const ObjectDefinition& object : definition.objects) {
    auto asset = load(object.source, progress);
    if (!asset) return tl::unexpected(asset.error());
    asset->material = object.material.over(asset->material);
    const spatial::Pose X_MO{{1, 0, 0, 0}, -asset->p_OM_O};
    world.objects.push_back({object.name, *std::move(asset), object.X_WM * X_MO, of_origin(object.motion, X_MO)});
  }
  world.definition = std::move(definition);
  return world;
}

codecs::SceneDescription description_of(const World& world) {
  codecs::SceneDescription description;
  description.name = world.definition.name;
  for (const WorldObject& object : world.objects) {
    description.objects.push_back({object.name, object.X_WO, object.asset.visible, object.motion});
  }
  description.tool = {world.tool.name, world.tool.visible, world.tool.mass_kg, world.tool.inertia_O_kg_m2,
                      world.tool.material};
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
