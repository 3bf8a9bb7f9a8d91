// NAME.poses, little-endian: u32 "FFPO", u32 how many, and for each seven doubles, R w x y z and p x y z [m].
// inputs.json: by name the hashes of motion and asset, and which of the asset's bodies is the tool.
#include "tests/bench/counted_inputs.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>

#include "deploy/replay/session_replay.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/loop_tick.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/strokes.h"

namespace farfeel::bench {
namespace {

using contact_service::TouchableObject;
using spatial::Pose;
using Bytes = std::vector<std::byte>;

constexpr std::uint32_t kMagic = 0x4F50'4646;  // "FFPO"
constexpr std::size_t kFrames = 2000;          // of a benchmark scene, at 1 kHz
constexpr std::uint64_t kSeed = 1;
constexpr double kSettle_s = 0.4, kPress_m = 0.6e-3, kStart_m = -0.015;  // of the stroke

template <typename T>
T value_or_stop(tl::expected<T, std::string> expected) {
  if (!expected) throw CLI::RuntimeError(expected.error(), 1);
  if constexpr (!std::is_void_v<T>) return *std::move(expected);
}

std::string named(std::uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

Bytes bytes_of(const std::vector<Pose>& motion) {
  Bytes bytes(2 * sizeof(std::uint32_t));
  const std::array<std::uint32_t, 2> head{kMagic, static_cast<std::uint32_t>(motion.size())};
  std::memcpy(bytes.data(), head.data(), bytes.size());
  for (const Pose& X : motion) {
    const std::array<double, 7> numbers{X.R.w, X.R.x, X.R.y, X.R.z, X.p.x, X.p.y, X.p.z};
    const auto more = std::as_bytes(std::span(numbers));
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  return bytes;
}

std::optional<std::vector<Pose>> motion_of(const Bytes& bytes) {
  std::array<std::uint32_t, 2> head{};
  if (bytes.size() < sizeof head) return {};
  std::memcpy(head.data(), bytes.data(), sizeof head);
  std::array<double, 7> n{};
  if (head[0] != kMagic || bytes.size() != sizeof head + head[1] * sizeof n) return {};
  std::vector<Pose> motion;
  for (std::size_t at = sizeof head; at < bytes.size(); at += sizeof n) {
    std::memcpy(n.data(), bytes.data() + at, sizeof n);
    motion.push_back({{n[0], n[1], n[2], n[3]}, {n[4], n[5], n[6]}});
  }
  return motion;
}

std::filesystem::path recordings_of(const std::filesystem::path& folder) {
  return folder / ".." / "recordings";
}

/// A benchmark scene, and a recording that was felt on its models.
struct Frozen {
  std::string_view scene, recording;
  std::uint32_t tool;  ///< of the asset's bodies, which are the tool and the object
};
constexpr std::array<Frozen, 5> kScenes{{{"file-cad", "file-on-cad-linear", 0},
                                         {"block-gear", "gear-on-block-tiles", 0},
                                         {"block-block", "gear-on-block-tiles", 1},
                                         {"hammer-torus", "hammer-on-torus-quadratic", 0},
                                         {"torus-torus", "hammer-on-torus-quadratic", 1}}};

/// Over the rough table and back at every speed, swaying and turning a little; first it rests.
std::vector<Pose> stroke_over(const StrokedScene& scene) {
  const StrokePath path(strokes_of_every_speed(), kStart_m);
  std::vector<Pose> motion;
  for (double t_s = -kSettle_s; t_s < path.length_s(); t_s += 1e-3) {
    const double along_m = path.at_m(t_s), way = along_m / 5e-3;
    motion.push_back(scene.X_WT(along_m, 1.5e-3 * std::sin(0.7 * way + 0.3 + 2 * std::max(0.0, t_s)),
                                0.1 * std::sin(0.4 * way), kPress_m));
  }
  return motion;
}

class Freezer {
 public:
  explicit Freezer(const std::filesystem::path& folder) : folder_(folder) {
    std::filesystem::create_directories(folder / "assets");
  }
  ~Freezer() { std::ofstream(folder_ / "inputs.json") << list_.dump(2) << '\n'; }
  Freezer(const Freezer&) = delete;
  Freezer& operator=(const Freezer&) = delete;

  void note(const std::string& name, const std::vector<Pose>& motion, std::uint64_t asset, std::uint32_t tool) {
    const Bytes poses = bytes_of(motion);
    value_or_stop(replay::write_bytes(folder_ / (name + ".poses"), poses));
    list_[name] = {{"motion", named(codecs::hashed(poses))}, {"asset", named(asset)}, {"tool", tool}};
  }
  void note(const std::string& name, const std::vector<Pose>& motion, std::span<const TouchableObject> bodies) {
    const Bytes asset = value_or_stop(codecs::write_felt_asset(bodies, {}));
    const std::uint64_t hash = codecs::hashed(asset);
    value_or_stop(replay::write_bytes(folder_ / "assets" / (named(hash) + ".felt"), asset));
    note(name, motion, hash, 0);
  }

 private:
  std::filesystem::path folder_;
  nlohmann::ordered_json list_;
};

}  // namespace

CountedInputs::CountedInputs(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::ifstream file(folder_ / "inputs.json");
  list_ = nlohmann::json::parse(file, nullptr, false);
  if (!list_.is_object())
    throw CLI::RuntimeError(
        fmt::format("{}/inputs.json can't be read: name the folder tests/counted with --inputs", folder_.string()), 1);
}

CountedScene CountedInputs::scene(const std::string& name) const {
  if (!list_.contains(name)) throw CLI::RuntimeError(fmt::format("inputs.json has no {}", name), 1);
  const nlohmann::json& entry = list_[name];
  const auto hash = entry["asset"].get<std::string>();
  std::filesystem::path where = folder_ / "assets" / (hash + ".felt");
  if (!std::filesystem::exists(where)) where = recordings_of(folder_) / "assets" / (hash + ".felt");
  const Bytes asset = value_or_stop(replay::bytes_of(where)),
              poses = value_or_stop(replay::bytes_of(folder_ / (name + ".poses")));
  auto motion = motion_of(poses);
  if (named(codecs::hashed(asset)) != hash || named(codecs::hashed(poses)) != entry["motion"] || !motion)
    throw CLI::RuntimeError(
        fmt::format("{}: {}.poses or {} is not what inputs.json was written with: take it from the repository again",
                    name, name, where.string()),
        1);
  CountedScene scene;
  scene.asset = std::make_unique<slave_sim::RecordedScene>(value_or_stop(codecs::read_felt_asset(asset)).scene,
                                                           std::span<const motion::MovingObject>());
  const auto bodies = scene.asset->bodies();
  scene.bodies = {bodies[entry["tool"].get<std::size_t>()], bodies[1]};
  scene.bodies.back().X_WO = {};
  scene.motion = *std::move(motion);
  return scene;
}

void CountedInputs::freeze(const std::filesystem::path& folder) {
  Freezer freezer(folder);
  for (const Frozen& frozen : kScenes) {
    const std::filesystem::path path = recordings_of(folder) / fmt::format("{}.ffrec", frozen.recording);
    const auto recording = value_or_stop(codecs::read_recording(value_or_stop(replay::bytes_of(path))));
    const auto bodies = value_or_stop(replay::asset_of(recording, path)).scene.bodies;
    codecs::Asset object, tool;
    object.felt = bodies[1].surface, tool.felt = bodies[frozen.tool].surface;
    const BenchmarkScene scene = benchmark_scene(frozen.scene, std::move(object), std::move(tool));
    freezer.note(std::string(frozen.scene), scene.motion(kSeed, kFrames), recording.assets.front(), frozen.tool);
  }
  const auto rough = stroked_scenes(SceneChoice::kOne);
  const StrokedScene& stroked = *rough.front();
  freezer.note("stroke", stroke_over(stroked), std::array{stroked.tool({}), stroked.object({})});

  const geometry::HapticSurface table = SevenContacts::usual_table(), tool = SevenContacts::usual_tool();
  const penetration::FeltSurface table_felt(table), tool_felt(tool);
  std::vector<Pose> handle;
  const double ticks = 1e9 * SevenContacts::usual_length_s() / static_cast<double>(SevenContacts::kTick_ns);
  for (std::int64_t i = 0; i < std::llround(ticks); ++i)
    handle.push_back(SevenContacts::usual_handle()(i * SevenContacts::kTick_ns));
  freezer.note("seven-contacts", handle,
               std::array{TouchableObject{&tool, {}, {}, &tool_felt}, TouchableObject{&table, {}, {}, &table_felt}});
}

}  // namespace farfeel::bench
