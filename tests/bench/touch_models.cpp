#include "tests/bench/touch_models.h"

#include <fmt/format.h>

#include <array>

#include "codecs/mesh/mesh_file.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/bake/repair.h"
#include "tests/bench/touch_solids.h"

namespace farfeel::bench {
namespace {

constexpr std::array<const char*, 6> kBenchmarkModels{"block", "gear", "file", "cad", "hammer", "torus"};
constexpr std::array<const char*, 5> kScans{"beast", "cheburashka", "cow", "rocker-arm", "stanford-bunny"};

struct Generator {
  const char* name;
  geometry::TriangleMesh (*mesh)(double size_mm);
  std::vector<double> sizes_mm;
};

std::vector<Generator> generators() {
  return {{"bowl", bowl_mesh, {1.5, 3, 6, 10, 15, 20}},
          {"dish", dish_mesh, {5}},
          {"cup", cup_mesh, {3}},
          {"lens", lens_mesh, {8}},
          {"tray", tray_mesh, {3}},
          {"tube", tube_mesh, {1, 3}},
          {"fins", fins_mesh, {1.5}},
          {"bolt", bolt_solid, {4}},
          {"nut", nut_solid, {4}},
          {"knurl", knurl_mesh, {2}},
          {"saw", saw_mesh, {0.5, 2}},
          {"spikes", spikes_mesh, {3}},
          {"sponge", sponge_mesh, {4}},
          {"leaf", leaf_mesh, {0.5}},
          {"wall", wall_mesh, {0.5, 1, 2, 5, 10, 30}}};
}

}  // namespace

std::vector<TouchModel> touch_models(const std::filesystem::path& scans) {
  std::vector<TouchModel> all;
  for (const Generator& g : generators()) {
    for (const double size_mm : g.sizes_mm)
      all.push_back({.name = fmt::format("{}-{}", g.name, size_mm), .generated = g.mesh, .size_mm = size_mm});
  }
  for (const char* name : kBenchmarkModels) all.push_back({.name = name, .benchmark = name});
  for (const char* name : kScans) all.push_back({.name = name, .scan = scans / fmt::format("{}.obj", name)});
  return all;
}

tl::expected<TouchMesh, std::string> touch_mesh(const TouchModel& model) {
  if (model.generated != nullptr) return TouchMesh{model.generated(model.size_mm), {}};
  if (!model.benchmark.empty()) {
    const slave_sim::Model* known = slave_sim::find_model(model.benchmark);
    if (known == nullptr) return tl::unexpected("there is no benchmark model " + model.benchmark);
    return TouchMesh{known->full_mesh(), slave_sim::model_bake_options(*known)};
  }
  std::error_code error;
  if (model.scan.parent_path().empty())
    return tl::unexpected(std::string("no folder of scans was named: --models or FARFEEL_MODELS does"));
  if (!std::filesystem::exists(model.scan, error))
    return tl::unexpected(
        fmt::format("no file {}; name its folder by --models or FARFEEL_MODELS", model.scan.string()));
  const auto read = codecs::read_mesh_file(model.scan);
  if (!read) return tl::unexpected(read.error().message);
  const double unit_m = kScanDiagonal_m / glm::length(geometry::bounding_box(*read).size());
  auto repaired = slave_sim::repaired(*read, unit_m);
  if (!repaired) return tl::unexpected(repaired.error().message);
  TouchMesh out{std::move(repaired->mesh), {}};
  out.options.left_out = std::move(repaired->left_out);
  return out;
}

}  // namespace farfeel::bench
