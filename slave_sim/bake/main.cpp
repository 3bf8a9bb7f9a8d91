// farfeel-bake: anybody's triangle mesh, or a benchmark model, becomes a haptic asset.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "codecs/mesh/mesh_file.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/bake/bake.h"
#include "slave_sim/bake/repair.h"
#include "slave_sim/bake/self_crossing.h"

namespace {

using namespace farfeel;

struct Request {
  std::string mesh, model, out, texture = "1024";
  double metres_per_unit = 1;
  std::uint32_t triangles = 700;
  double density_kg_per_m3 = 1200;
  contact::Material material;
};

int complain(const std::string& message) {
  fmt::print(stderr, "farfeel-bake: {}\n", message);
  return 1;
}

void print(const std::string& name, const slave_sim::BakeReport& r) {
  fmt::print("{}\n", name);
  fmt::print("  triangles   {} -> {} coarse, {} convex pieces, {} charts, {} tiles\n", r.full_triangles,
             r.coarse_triangles, r.pieces, r.charts, r.tiles);
  fmt::print("  texel       {:.0f} um; {} texels over the surface, {} missed\n", 1e6 * r.texel_m, r.texels,
             r.missed_texels);
  fmt::print("  deviation   full to felt {:.1f} um rms, {:.0f} um max; felt to full {:.1f} um rms, {:.0f} um max\n",
             1e6 * r.full_to_felt.rms_m, 1e6 * r.full_to_felt.max_m, 1e6 * r.felt_to_full.rms_m,
             1e6 * r.felt_to_full.max_m);
  fmt::print("  spectrum    relief {:.0f} um rms, {:.2f} % of it finer than two texels; texture {} would keep it\n",
             1e6 * r.relief_rms_m, 100 * r.lost_share, r.keeping_texture);
  fmt::print("  slope       {:.4f} rms from the full mesh's\n", r.felt_slope.rms);
  fmt::print("  seams       {:.2f} um rms, {:.0f} um max; slope {:.4f} rms, across chart borders\n",
             1e6 * r.seam_step.rms_m, 1e6 * r.seam_step.max_m, r.seam_slope.rms);
  double seconds = 0;
  fmt::print("  time       ");
  for (const auto& stage : r.stages) {
    seconds += stage.seconds;
    fmt::print(" {} {:.2f} s,", stage.stage, stage.seconds);
  }
  fmt::print(" together {:.2f} s\n", seconds);
}

/// The mesh that was asked for, closed and oriented.
tl::expected<geometry::TriangleMesh, std::string> mesh_of(const Request& request) {
  const auto given = codecs::read_mesh_file(request.mesh);
  if (!given) return tl::unexpected(given.error().message);
  auto fixed = slave_sim::repaired(*given, request.metres_per_unit);
  if (!fixed) return tl::unexpected(fmt::format("cannot bake {}: {}", request.mesh, fixed.error().message));
  for (const std::string& note : fixed->notes) fmt::print("repaired: {}\n", note);
  if (const auto words = slave_sim::words_about(slave_sim::self_crossing(fixed->mesh)))
    fmt::print("mind: {}\n", *words);
  return std::move(fixed->mesh);
}

int run(const Request& request) {
  geometry::TriangleMesh mesh;
  slave_sim::BakeOptions options;
  std::string name;
  if (!request.model.empty()) {
    const slave_sim::Model* model = slave_sim::find_model(request.model);
    if (model == nullptr) return complain(fmt::format("there is no model {}", request.model));
    name = request.model;
    options = slave_sim::model_bake_options(*model);
    mesh = model->full_mesh();
  } else {
    auto given = mesh_of(request);
    if (!given) return complain(given.error());
    name = std::filesystem::path(request.mesh).stem().string();
    mesh = std::move(*given);
    options.coarse_triangles = request.triangles;
    options.density_kg_per_m3 = request.density_kg_per_m3;
    options.material = request.material;
  }
  options.texture =
      request.texture == "auto" ? slave_sim::kTextureAuto : static_cast<std::uint32_t>(std::stoul(request.texture));

  const bool is_watched = isatty(fileno(stdout)) != 0;
  const auto baked = slave_sim::bake_asset(name, mesh, options, [&](const std::string& stage, double done) {
    if (is_watched) fmt::print("\r{:3.0f} % {:<12}", 100 * done, stage), std::fflush(stdout);
  });
  if (is_watched) fmt::print("\r{:<20}\r", "");
  if (!baked) return complain(baked.error().message);
  print(name, baked->report);
  if (const auto written = codecs::write_asset_file(baked->asset, request.out); !written)
    return complain(written.error().message);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bakes a triangle mesh into a haptic asset (.glb)", "farfeel-bake");
  Request request;
  const std::map<std::string, double> units{{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"um", 1e-6}, {"in", 0.0254}};
  auto* mesh = app.add_option("mesh", request.mesh, "OBJ, PLY, STL, .glb or .gltf")->check(CLI::ExistingFile);
  auto* model = app.add_option("--model", request.model,
                               "a benchmark model instead of a file: block, gear, hammer, cad, file, torus");
  mesh->excludes(model);
  app.add_option("-o,--output", request.out, "the asset to write")->required();
  app.add_option("--unit", request.metres_per_unit, "what one unit of the file is")
      ->transform(CLI::CheckedTransformer(units));
  app.add_option("--triangles", request.triangles, "aim for the coarse mesh")
      ->check(CLI::Range(4U, 100'000U))
      ->capture_default_str();
  app.add_option("--texture", request.texture,
                 "side of a square of as many texels as the charts may have together, or auto: what the surface needs")
      ->check(CLI::Range(16U, 16384U) | CLI::IsMember({"auto"}))
      ->capture_default_str();
  app.add_option("--density", request.density_kg_per_m3, "kg/m^3, for mass and inertia")->capture_default_str();
  app.add_option("--stiffness", request.material.stiffness_N_per_m, "N/m")->capture_default_str();
  app.add_option("--damping", request.material.damping_Ns_per_m, "N s/m")->capture_default_str();
  app.add_option("--static-friction", request.material.static_friction)->capture_default_str();
  app.add_option("--dynamic-friction", request.material.dynamic_friction)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (request.mesh.empty() == request.model.empty())
    return complain("name a mesh file, or --model and a benchmark model");
  return run(request);
}
