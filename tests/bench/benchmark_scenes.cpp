#include "tests/bench/benchmark_scenes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <utility>

#include "slave_sim/bake/asset_cache.h"

namespace farfeel::bench {
namespace {

constexpr double kTolerance_m = 0.005;
// 104 +- 15 near pairs, at least three contacts, touching at least 70 % of the time.
constexpr MotionWanted kFileOnCad{104, 13, 3.05, 0.71};

struct Definition {
  std::string_view name;
  const char *S, *T;
  bool is_on_its_rim;  ///< T is turned upright
  double tilt_rad, turn_rad;
  double region;  ///< half its size, in sizes of S, about S's centre
  std::optional<MotionWanted> wanted;
};
constexpr std::array<Definition, 5> kDefinitions{{{"file-cad", "cad", "file", false, 0.03, 0.3, 0.05, kFileOnCad},
                                                  {"block-gear", "block", "gear", true, 0.06, 0.6, 0.25, {}},
                                                  {"block-block", "block", "block", false, 0.02, 0.6, 0.25, {}},
                                                  {"hammer-torus", "torus", "hammer", false, 0.2, 0.6, 0.25, {}},
                                                  {"torus-torus", "torus", "torus", true, 0.2, 0.6, 0.25, {}}}};

constexpr auto kNames = [] {
  std::array<std::string_view, kDefinitions.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kDefinitions[i].name;
  return names;
}();

codecs::Asset asset_of(const char* model) {
  auto asset = slave_sim::cached_model_asset(model);
  if (!asset) throw CLI::RuntimeError(asset.error().message, 1);
  return *std::move(asset);
}

const Definition& definition_of(std::string_view name) {
  for (const Definition& d : kDefinitions)
    if (name == d.name) return d;
  throw CLI::ValidationError("--scenes", fmt::format("no benchmark scene is called {}; there are {}", name,
                                                     fmt::join(benchmark_scene_names(), ", ")));
}

}  // namespace

std::span<const std::string_view> benchmark_scene_names() {
  return kNames;
}

BenchmarkScene benchmark_scene(std::string_view name) {
  const Definition& d = definition_of(name);
  return benchmark_scene(name, asset_of(d.S), asset_of(d.T));
}

BenchmarkScene benchmark_scene(std::string_view name, codecs::Asset object, codecs::Asset tool) {
  const Definition& d = definition_of(name);
  BenchmarkScene scene{std::string(name), std::move(object), std::move(tool), kTolerance_m, {}, d.wanted, nullptr};
  const geometry::Box box_s = geometry::bounding_box(scene.object.felt.coarse);
  const double radius_t_m = 0.5 * glm::length(geometry::bounding_box(scene.tool.felt.coarse).size());
  if (d.is_on_its_rim) scene.plan.X_ST_rest.R = spatial::rotation_from_vector({M_PI / 2, 0, 0});
  scene.plan.tilt_rad = d.tilt_rad, scene.plan.turn_rad = d.turn_rad;
  scene.plan.region_low_m = box_s.centre() - d.region * box_s.size();
  scene.plan.region_high_m = box_s.centre() + d.region * box_s.size();
  scene.plan.region_high_m.z = box_s.high.z + radius_t_m;
  return scene;
}

std::vector<spatial::Pose> BenchmarkScene::motion(std::uint64_t seed, std::size_t frames) const {
  MotionBodies bodies(object.felt, tool.felt);
  if (!wanted) return recorded_motion(bodies, tolerance_m, plan, seed, frames);
  return recorded_motion_like(bodies, tolerance_m, plan, seed, frames, *wanted);
}

}  // namespace farfeel::bench
