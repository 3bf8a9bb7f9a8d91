// What the master is told of the remote scene before it touches anything: enough to draw it and to simulate the tool.
//
// What is felt never travels here: that comes as contacts. Visible meshes are Draco-coded, quantised to 14 bits of each
// mesh's own box, so positions are off by up to half a step (box size / 2^15) and vertices come back in another order.
// A scan's colours come with its vertices; a mesh without any takes no byte for them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/mesh/draco_mesh.h"
#include "codecs/scene/exploration.h"
#include "haptic_core/contact/material.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

struct SceneObject {
  std::string name;
  spatial::Pose X_WO;  ///< at scene time 0
  geometry::TriangleMesh visible_O;
  std::optional<motion::ScriptedMotion> motion = {};  ///< none: it stands still
  bool may_change = false;                            ///< courses may be told of it; it has no motion then
  bool is_there = true;                               ///< in the beginning; false of what may change alone
  std::vector<Colour> colours = {};                   ///< of visible_O: one a vertex, or none
};

/// The rigid tool. Its frame T has its origin at the centre of mass.
struct SceneTool {
  std::string name;
  geometry::TriangleMesh visible_T;
  double mass_kg = 0;
  glm::dmat3 inertia_To_T_kg_m2{0};  ///< about To, in T; symmetric, positive
  contact::Material material;        ///< of its surface: what stiffness to expect
  std::vector<Colour> colours;       ///< of visible_T: one a vertex, or none
};

struct SceneDescription {
  std::string name;
  std::vector<SceneObject> objects;
  SceneTool tool;
  Exploration exploration;
  double tolerance_m = 0.005;  ///< > 0; contacts nearer than this are told of
  double workspace_scale = 1;  ///< > 0; metres of tool motion per metre of device motion
  double force_scale = 1;      ///< > 0; newtons on the hand per newton on the tool
  bool has_clutch = true;      ///< the handle may be moved without the tool
};

// Bounds of the format: the writer refuses to exceed them, the reader refuses them before it allocates.
inline constexpr std::size_t kMaxSceneObjects = 256;
inline constexpr std::size_t kMaxNameBytes = 128;
inline constexpr double kMaxPlace_m = 1e4;  ///< of whatever has a place in the world, from its origin, along each axis
inline constexpr std::size_t kMaxSceneBytes = 64u << 20;

struct SceneError {
  std::string message;  ///< of write_scene: what was tried and what was wrong; of read_scene: what was wrong
};

/// One blob, at most kMaxSceneBytes. Fails on anything that is not finite, out of bounds, or a mesh without a triangle.
[[nodiscard]] tl::expected<std::vector<std::byte>, SceneError> write_scene(const SceneDescription&);
/// For bytes from anybody: bounds are checked before anything is allocated, and every value before it is used. decode
/// is called once all else is right, with meshes within the format's bounds: here, or in a process apart.
[[nodiscard]] tl::expected<SceneDescription, SceneError> read_scene(std::span<const std::byte> blob,
                                                                    const DecodeMeshes& decode = decode_meshes);

}  // namespace farfeel::codecs
