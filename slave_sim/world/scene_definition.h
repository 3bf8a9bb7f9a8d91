// What a scene file says: which objects stand where, what the tool is, where an operator would explore.
//
// A scene file is TOML (scene.schema.json); slave_sim/world/scenes/ holds those that are built in. Every length is in
// metres, every angle in degrees (the key says so). Unknown keys are errors, because a misspelt key that is ignored is
// felt, not seen.
//
// A file may say where the world's origin is in its own coordinates, and so in those of its meshes: a survey's are
// millions of metres. All poses here are about that origin.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/scene/exploration.h"
#include "haptic_core/contact/material.h"
#include "haptic_core/motion/course.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {

/// Where a shape comes from: one of the two, or neither while it is still to be given on the command line.
struct AssetSource {
  std::string model;            ///< a built-in model by name, baked once into the cache folder
  std::filesystem::path asset;  ///< a .glb file; relative paths are relative to the scene file
  [[nodiscard]] bool is_given() const { return model.empty() && asset.empty(); }
};

/// What a scene says otherwise than an asset; the rest is the asset's.
struct MaterialOverride {
  std::optional<double> stiffness_N_per_m = {}, damping_Ns_per_m = {}, static_friction = {}, dynamic_friction = {};
  [[nodiscard]] contact::Material over(contact::Material) const;
};

struct ObjectDefinition {
  std::string name;
  AssetSource source;
  spatial::Pose X_WM;  ///< of the mesh's own frame: what a person reads in the program that made it
  MaterialOverride material = {};
  std::optional<motion::ScriptedMotion> motion = {};  ///< of X_WM, instead of it
  bool may_change = false;                            ///< edits move it, bring it or take it away
  bool is_there = true;                               ///< in the beginning
};

/// One edit of the scene while it lives.
struct TimedEdit {
  enum class Kind : std::uint8_t { kStamp, kSpawn, kMove, kRemove, kRevert };
  double at_s = 0;  ///< scene time of the first master's loop
  Kind kind = Kind::kStamp;
  std::uint32_t object = 0;
  glm::dvec3 place_M{0};                   ///< of a stamp: in the mesh's own frame
  double radius_m = 0, depth_m = 0;        ///< of a stamp
  std::optional<spatial::Pose> X_WM = {};  ///< of a spawn or a move
  double takes_s = 0;                      ///< of a move
};

struct SceneDefinition {
  std::string name;
  std::string title;
  std::optional<glm::dvec3> origin_m;  ///< of the world, in the file's coordinates; none: not said
  double tolerance_m = 0.005;          ///< > 0; contacts are looked for up to this distance
  std::uint32_t grid_samples = 50;     ///< along a side of the penetration grid, 4..400
  double softness_m = 10e-6;           ///< width of the soft maximum, > 0
  double workspace_scale = 1;          ///< metres of the tool for a metre of the handle, 0.01..100
  double force_scale = 1;              ///< newtons on the hand for a newton on the tool, 0.01..100
  bool has_clutch = true;              ///< the handle may be moved without the tool
  AssetSource tool;
  MaterialOverride tool_material;
  std::vector<ObjectDefinition> objects;           ///< at least one
  std::vector<TimedEdit> timeline = {};            ///< times do not fall
  bool is_editable = false;                        ///< while it lives, by those who may
  double stamp_room_m = 0.001;                     ///< how much lower heights may get then
  std::optional<codecs::Exploration> exploration;  ///< its p_TWork_T is still in the tool mesh's own frame; without it
                                                   ///< the world finds a place to touch
};

struct SceneError {
  std::string message;  ///< file, line, what was wrong, what is allowed
};

/// Reads scene text. origin is what errors call it; base is the folder that relative asset paths start from.
[[nodiscard]] tl::expected<SceneDefinition, SceneError> parse_scene(std::string_view toml, std::string_view origin,
                                                                    const std::filesystem::path& base);
/// A built-in scene by name, or else a scene file by path.
[[nodiscard]] tl::expected<SceneDefinition, SceneError> find_scene(std::string_view name_or_path);
[[nodiscard]] std::vector<std::string> built_in_scene_names();
/// Whoever may edit it may change it while it lives.
void make_editable(SceneDefinition&);
/// Moves the world's origin there, in its coordinates up to now, and the poses the other way.
void move_origin(SceneDefinition&, const glm::dvec3& to_m);
/// One asset explored with another: the object stands at the world's origin.
[[nodiscard]] SceneDefinition scene_of(const std::filesystem::path& object, const std::filesystem::path& tool);

/// What a command line asks for. Empty: not asked for. The scene is built in or a file: file-cad unless told,
/// scan-probe with an object alone. The object is an asset: for a scene that leaves one to be given, or with a tool for
/// a scene on the fly; the tool is an asset too.
struct SceneWish {
  std::string scene = {}, object = {}, tool = {};
};
/// Complete, or what to add to the wish.
[[nodiscard]] tl::expected<SceneDefinition, SceneError> wished_scene(const SceneWish&);

}  // namespace farfeel::slave_sim
