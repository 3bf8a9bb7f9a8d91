// The blob, little-endian:
//   u32 "FFSC", u16 version (5 if a mesh has colours, else 4), u16 0, string name, f64 tolerance_m, f64
//   workspace_scale, f64 force_scale, u16 has_clutch (0 or 1), tool, exploration, u16 objects, then each object.
//   string: u16 bytes, printable ASCII or UTF-8 without control characters.
//   mesh: u32 triangles claimed by the bitstream at most kMaxMeshTriangles, u32 bytes, a Draco bitstream of
//     positions and, in version 5, at most colours.
//   tool: string name, f64 mass_kg, f64 inertia xx yy zz xy xz yz, 4 f64 material, mesh.
//   exploration: 5 vectors of 3 f64, f64 press_force_N, f64 stroke_speed_m_per_s.
//   object: string name, pose X_WO, u16 life (0 it is there for good, 1 it may change and is there, 2 it may change and
//     is not there yet), u16 keys (0: it stands still), u16 afterwards (0 stays, 1 repeats), then each key, f64 at_s,
//     pose X_WO; mesh.
//   pose: 3 f64 position, 4 f64 quaternion w x y z.

#include "codecs/scene/scene_description.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "codecs/mesh/draco_mesh.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;
using transport::ByteWriter;

constexpr std::uint32_t kSceneMagic = 0x4353'4646;                // "FFSC"
constexpr std::uint16_t kPlainVersion = 4, kColouredVersion = 5;  // who reads the latter reads the former, too
constexpr double kMaxMass_kg = 1e4;
constexpr std::size_t kFixedBytes = 1024;  // more than everything but names, meshes and objects takes
constexpr std::size_t kKeyBytes = 64;
constexpr std::size_t kObjectFixedBytes = 72 + kMaxNameBytes + motion::kMostKeyframes * kKeyBytes;

bool is_within(double v, double low, double high) {
  return v >= low && v <= high;
}  // false for NaN
bool is_place(const glm::dvec3& v) {
  return is_within(v.x, -kMaxPlace_m, kMaxPlace_m) && is_within(v.y, -kMaxPlace_m, kMaxPlace_m) &&
         is_within(v.z, -kMaxPlace_m, kMaxPlace_m);
}
bool is_unit(const glm::dvec3& v) {
  return std::abs(glm::length(v) - 1) < 1e-6;
}
bool is_pose(const spatial::Pose& X) {
  return spatial::is_valid(X) && is_place(X.p);
}
bool is_name(const std::string& name) {
  return name.size() <= kMaxNameBytes && std::all_of(name.begin(), name.end(), [](char c) {
           return static_cast<unsigned char>(c) >= 0x20 && c != 0x7F;
         });
}

/// Physical: symmetric, positive definite, and no principal moment larger than the other two together.
bool is_inertia(const glm::dmat3& I) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!is_within(I[i][j], -1e8, 1e8) || I[i][j] != I[j][i]) return false;
      largest = std::max(largest, std::abs(I[i][j]));
    }
  }
  const double minor = I[0][0] * I[1][1] - I[0][1] * I[1][0];
  return largest > 0 && I[0][0] > 0 && minor > 0 && glm::determinant(I) > 0;
}

/// Everything but the meshes, for both directions: what is wrong, if anything.
std::optional<std::string> fault_of(const SceneDescription& scene) {
  const SceneTool& tool = scene.tool;
  const Exploration& e = scene.exploration;
  if (!is_name(scene.name)) return "the scene's name is too long or not printable";
  if (!(scene.tolerance_m > 0 && scene.tolerance_m <= 1)) return "tolerance_m must be in (0, 1]";
  if (!is_within(scene.workspace_scale, 1e-4, 1e4)) return "workspace_scale must be in [1e-4, 1e4]";
  if (!is_within(scene.force_scale, 1e-4, 1e4)) return "force_scale must be in [1e-4, 1e4]";
  if (!is_name(tool.name)) return "the tool's name is too long or not printable";
  if (!(tool.mass_kg > 0 && tool.mass_kg <= kMaxMass_kg)) return "the tool's mass_kg must be in (0, 1e4]";
  if (!is_inertia(tool.inertia_To_T_kg_m2)) return "the tool's inertia must be symmetric and positive definite";
  if (!is_within(tool.material.stiffness_N_per_m, 0, 1e8) || !is_within(tool.material.damping_Ns_per_m, 0, 1e6) ||
      !is_within(tool.material.static_friction, 0, 100) || !is_within(tool.material.dynamic_friction, 0, 100))
    return "the tool's material must have no negative and no absurd value";
  for (const SceneObject& object : scene.objects) {
    if (!is_name(object.name)) return "an object's name is too long or not printable";
    if (!is_place(object.X_WO.p))
      return "object '" + object.name + "' stands more than 10 km from the world's origin; place it with origin_m";
    if (!is_pose(object.X_WO)) return "object '" + object.name + "': X_WO is not a pose";
    if (object.may_change ? object.motion.has_value() : !object.is_there)
      return "object '" + object.name + "' moves by a script and may change, or is not there and may not change";
    if (object.motion && !std::all_of(object.motion->keys().begin(), object.motion->keys().end(),
                                      [](const motion::Keyframe& key) { return is_pose(key.X_WO); }))
      return "object '" + object.name + "': a key of its motion is not a pose";
  }
  if (!is_place(e.p_TWork_T) || !is_place(e.region_low_W) || !is_place(e.region_high_W))
    return "exploration: a point is not finite or beyond 10 km";
  if (!is_unit(e.nhat_work_T) || !is_unit(e.approach_W)) return "exploration: a direction is not of unit length";
  if (!is_within(e.press_force_N, 0, 1e4) || !is_within(e.stroke_speed_m_per_s, 0, 100))
    return "exploration: press_force_N or stroke_speed_m_per_s is negative or absurd";
  return std::nullopt;
}

void write_string(ByteWriter& w, const std::string& s) {
  w.u16(static_cast<std::uint16_t>(s.size()));
  w.bytes(std::as_bytes(std::span(s)));
}
void write_vector(ByteWriter& w, const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i) w.f64(v[i]);
}
void write_pose(ByteWriter& w, const spatial::Pose& X) {
  write_vector(w, X.p);
  for (const double c : {X.R.w, X.R.x, X.R.y, X.R.z}) w.f64(c);
}
void write_mesh(ByteWriter& w, const geometry::TriangleMesh& mesh, std::span<const std::byte> bitstream) {
  w.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
  w.u32(static_cast<std::uint32_t>(bitstream.size()));
  w.bytes(bitstream);
}
// The six free entries of a symmetric matrix, in the blob's order.
constexpr std::array<std::array<int, 2>, 6> kInertiaEntries{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

std::string read_string(ByteReader& r) {
  const std::size_t size = r.u16();
  const auto bytes = r.bytes(size <= kMaxNameBytes ? size : r.remaining() + 1);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
glm::dvec3 read_vector(ByteReader& r) {
  glm::dvec3 v;
  for (int i = 0; i < 3; ++i) v[i] = r.f64();
  return v;
}
spatial::Pose read_pose(ByteReader& r) {
  spatial::Pose X;
  X.p = read_vector(r);
  for (double* c : {&X.R.w, &X.R.x, &X.R.y, &X.R.z}) *c = r.f64();
  return X;
}

void write_motion(ByteWriter& w, const std::optional<motion::ScriptedMotion>& motion) {
  w.u16(motion ? static_cast<std::uint16_t>(motion->keys().size()) : 0);
  w.u16(motion && motion->afterwards() == motion::Afterwards::kRepeats ? 1 : 0);
  if (!motion) return;
  for (const motion::Keyframe& key : motion->keys()) {
    w.f64(key.at_s);
    write_pose(w, key.X_WO);
  }
}
/// What is wrong with the script, if anything; a cut is left for the end of all to notice.
std::optional<std::string> read_motion(ByteReader& r, std::optional<motion::ScriptedMotion>& motion) {
  const std::size_t count = r.u16();
  const std::uint16_t afterwards = r.u16();
  if (count > motion::kMostKeyframes || afterwards > 1) return "a motion has too many keys, or an unknown end";
  std::vector<motion::Keyframe> keys(count);
  for (motion::Keyframe& key : keys) {
    key.at_s = r.f64();
    key.X_WO = read_pose(r);
  }
  if (count == 0 || !r.ok()) return std::nullopt;
  const auto then = afterwards == 1 ? motion::Afterwards::kRepeats : motion::Afterwards::kStays;
  if (auto fault = motion::fault_of(keys, then)) return fault;
  motion.emplace(keys, then);
  return std::nullopt;
}

CodedMesh read_coded_mesh(ByteReader& r) {
  CodedMesh mesh;
  mesh.triangles = r.u32();
  mesh.bitstream = r.bytes(r.u32());
  return mesh;
}

tl::unexpected<SceneError> cannot_write(const std::string& why) {
  return tl::unexpected(SceneError{"cannot describe the scene to a master: " + why});
}
tl::unexpected<SceneError> cannot_read(const std::string& why) {
  return tl::unexpected(SceneError{why});
}

}  // namespace

tl::expected<std::vector<std::byte>, SceneError> write_scene(const SceneDescription& scene) {
  if (const auto fault = fault_of(scene)) return cannot_write(*fault);
  if (scene.objects.size() > kMaxSceneObjects) return cannot_write("it has more than 256 objects");

  std::vector<std::vector<std::byte>> bitstreams;  // the tool's, then the objects'
  std::uint64_t triangles = 0;
  std::size_t size = kFixedBytes;
  bool is_coloured = false;
  const auto encode = [&](const std::string& name, const geometry::TriangleMesh& mesh,
                          const std::vector<Colour>& colours) -> std::optional<std::string> {
    if (mesh.triangles.size() > kMaxMeshTriangles) return "'" + name + "' has more than 2 million triangles";
    if ((triangles += mesh.triangles.size()) > kMaxSceneTriangles)
      return "its meshes have more than 4 million triangles";
    if (!colours.empty() && colours.size() != mesh.positions_O.size())
      return "'" + name + "' has " + std::to_string(colours.size()) + " colours for its vertices, which are " +
             std::to_string(mesh.positions_O.size());
    is_coloured = is_coloured || !colours.empty();
    auto bitstream = write_draco(mesh, kPositionBits, colours);
    if (!bitstream) return "'" + name + "': " + bitstream.error();
    if (bitstream->size() > kMaxMeshBytes) return "'" + name + "' takes more than 32 MiB";
    size += kObjectFixedBytes + bitstream->size();
    bitstreams.push_back(std::move(*bitstream));
    return std::nullopt;
  };
  if (const auto fault = encode(scene.tool.name, scene.tool.visible_T, scene.tool.colours)) return cannot_write(*fault);
  for (const SceneObject& object : scene.objects) {
    if (const auto fault = encode(object.name, object.visible_O, object.colours)) return cannot_write(*fault);
  }

  std::vector<std::byte> blob(size);
  ByteWriter w(blob);
  w.u32(kSceneMagic);
  w.u16(is_coloured ? kColouredVersion : kPlainVersion);
  w.u16(0);
  write_string(w, scene.name);
  w.f64(scene.tolerance_m);
  w.f64(scene.workspace_scale);
  w.f64(scene.force_scale);
  w.u16(scene.has_clutch ? 1 : 0);
  const SceneTool& tool = scene.tool;
  write_string(w, tool.name);
  w.f64(tool.mass_kg);
  for (const auto& [i, j] : kInertiaEntries) w.f64(tool.inertia_To_T_kg_m2[i][j]);
  for (const double v : {tool.material.stiffness_N_per_m, tool.material.damping_Ns_per_m, tool.material.static_friction,
                         tool.material.dynamic_friction})
    w.f64(v);
  write_mesh(w, tool.visible_T, bitstreams.front());
  const Exploration& e = scene.exploration;
  for (const glm::dvec3& v : {e.p_TWork_T, e.nhat_work_T, e.region_low_W, e.region_high_W, e.approach_W})
    write_vector(w, v);
  w.f64(e.press_force_N);
  w.f64(e.stroke_speed_m_per_s);
  w.u16(static_cast<std::uint16_t>(scene.objects.size()));
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    write_string(w, scene.objects[i].name);
    write_pose(w, scene.objects[i].X_WO);
    w.u16(!scene.objects[i].may_change ? 0 : scene.objects[i].is_there ? 1 : 2);
    write_motion(w, scene.objects[i].motion);
    write_mesh(w, scene.objects[i].visible_O, bitstreams[i + 1]);
  }
  if (!w.ok() || w.size() > kMaxSceneBytes) return cannot_write("it takes more than 64 MiB");
  blob.resize(w.size());
  return blob;
}

tl::expected<SceneDescription, SceneError> read_scene(std::span<const std::byte> blob, const DecodeMeshes& decode) {
  if (blob.size() > kMaxSceneBytes) return cannot_read("it is larger than 64 MiB");
  ByteReader r(blob);
  if (r.u32() != kSceneMagic) return cannot_read("it does not begin as a scene");
  if (const auto version = r.u16(); version < kPlainVersion || version > kColouredVersion || r.u16() != 0)
    return cannot_read("its version is " + std::to_string(version) + ", not " + std::to_string(kPlainVersion) + " or " +
                       std::to_string(kColouredVersion) + ": run the same release of farfeel at both ends");
  SceneDescription scene;
  scene.name = read_string(r);
  scene.tolerance_m = r.f64();
  scene.workspace_scale = r.f64();
  scene.force_scale = r.f64();
  const std::uint16_t clutch = r.u16();
  if (clutch > 1) return cannot_read("its clutch is neither there nor not");
  scene.has_clutch = clutch == 1;
  SceneTool& tool = scene.tool;
  tool.name = read_string(r);
  tool.mass_kg = r.f64();
  for (const auto& [i, j] : kInertiaEntries) tool.inertia_To_T_kg_m2[i][j] = tool.inertia_To_T_kg_m2[j][i] = r.f64();
  for (double* v : {&tool.material.stiffness_N_per_m, &tool.material.damping_Ns_per_m, &tool.material.static_friction,
                    &tool.material.dynamic_friction})
    *v = r.f64();
  std::vector<CodedMesh> meshes{read_coded_mesh(r)};
  Exploration& e = scene.exploration;
  for (glm::dvec3* v : {&e.p_TWork_T, &e.nhat_work_T, &e.region_low_W, &e.region_high_W, &e.approach_W})
    *v = read_vector(r);
  e.press_force_N = r.f64();
  e.stroke_speed_m_per_s = r.f64();
  const std::size_t objects = r.u16();
  if (!r.ok() || objects > kMaxSceneObjects) return cannot_read("it is cut short, or has too many objects");
  for (std::size_t i = 0; i < objects && r.ok(); ++i) {
    SceneObject& object = scene.objects.emplace_back();
    object.name = read_string(r);
    object.X_WO = read_pose(r);
    const std::uint16_t life = r.u16();
    if (life > 2) return cannot_read("an object is neither there nor away");
    object.may_change = life > 0;
    object.is_there = life < 2;
    if (const auto fault = read_motion(r, object.motion)) return cannot_read(*fault);
    meshes.push_back(read_coded_mesh(r));
  }
  if (!r.is_at_end()) return cannot_read("its length does not fit its contents");
  if (const auto fault = fault_of(scene)) return cannot_read(*fault);
  if (const auto fault = fault_of(meshes)) return cannot_read(*fault);
  auto decoded = decode(meshes);
  if (!decoded) return cannot_read(decoded.error());
  const auto take = [](ColouredMesh& mesh, geometry::TriangleMesh& visible, std::vector<Colour>& colours) {
    colours = std::move(mesh.colours);
    visible = std::move(mesh);
  };
  take(decoded->front(), tool.visible_T, tool.colours);
  for (std::size_t i = 0; i < objects; ++i)
    take((*decoded)[i + 1], scene.objects[i].visible_O, scene.objects[i].colours);
  return scene;
}

}  // namespace farfeel::codecs
