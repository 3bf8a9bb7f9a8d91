// A scene made real: its definition with every shape loaded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "codecs/asset/asset.h"
#include "codecs/scene/scene_description.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/world/scene_definition.h"

namespace farfeel::slave_sim {

struct WorldObject {
  std::string name;
  codecs::Asset asset;
  spatial::Pose X_WO;                                 ///< at scene time 0
  std::optional<motion::ScriptedMotion> motion = {};  ///< none: it stands still
  bool may_change = false, is_there = true;           ///< as the definition says
};

struct World {
  SceneDefinition definition;
  std::vector<WorldObject> objects;  ///< as in the definition, in its order
  codecs::Asset tool;                ///< its origin is its centre of mass
  std::vector<std::string> notes;    ///< on where things stand and what is not kept, in words
};

/// Loads every asset a scene names; benchmark models that are not in the cache folder yet are baked first, which takes
/// up to a minute: progress says so. Where the scene does not say where the world's origin is and an object stands
/// farther from it than the wire reaches, the origin goes to the first object. Fails with the asset's name and what to
/// do.
[[nodiscard]] tl::expected<World, SceneError> load_world(SceneDefinition, const Progress& = {});

/// What a master is told of this world: visible meshes, the tool's mass, what an operator would do.
[[nodiscard]] codecs::SceneDescription description_of(const World&);

}  // namespace farfeel::slave_sim
