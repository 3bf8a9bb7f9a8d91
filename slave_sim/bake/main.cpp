// farfeel-bake: anybody's triangle mesh, or a benchmark model, becomes a haptic asset.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "codecs/settings/command_line.h"
#include "codecs/text/whole_file.h"
#include "slave_sim/bake/assembly.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/bake/bake.h"
#include "slave_sim/bake/bake_within.h"
#include "slave_sim/bake/drawn_mesh.h"
#include "slave_sim/bake/foreseen.h"
#include "slave_sim/bake/given_mesh.h"
#include "slave_sim/bake/near_pairs.h"
#include "slave_sim/bake/progress_line.h"
#include "slave_sim/bake/unit_of_length.h"
#include "slave_sim/bake/up_axis.h"

namespace {

using namespace farfeel;

struct Request {
  std::string mesh, model, out, texture, unit, up, error, close, thicken;
  std::optional<std::uint32_t> triangles;
  double density_kg_per_m3 = 1200;
  std::uint64_t memory_bytes = 0;  ///< 0: unsaid
  contact::Material material;
  bool is_check = false, is_parts = false, accepts_error = false;
};

int complain(const std::string& message) {
  fmt::print(stderr, "farfeel-bake: {}\n", message);
  return 1;
}

int misused(const std::string& message) {
  (void)complain(message);
  return codecs::kUsageError;
}

void print(const std::string& name, const slave_sim::BakeReport& r) {
  fmt::print("{}\n", name);
  fmt::print("  triangles   {} -> {} coarse, {} convex pieces, {} charts, {} tiles\n", r.full_triangles,
             r.coarse_triangles, r.pieces, r.charts, r.tiles);
  if (r.beyond_budget > 0)
    fmt::print("  beyond aim  {} of the coarse triangles: thin material and smooth edges need them\n", r.beyond_budget);
  fmt::print("  hulls       {} leave the solid (worst {:.0f} um), {} pass its middle (worst {:.0f} um)\n",
             r.breaches.outside, 1e6 * r.breaches.worst_outside_m, r.breaches.past_middle,
             1e6 * r.breaches.worst_past_middle_m);
  fmt::print("  texel       {:.0f} um; {} texels over the surface, {} missed\n", 1e6 * r.texel_m, r.texels,
             r.missed_texels);
  const auto told = [](const slave_sim::Deviation& d) {
    return fmt::format(
        "{:.1f} um rms, 99 % within {:.0f} um, 99.9 % within {:.0f} um, {:.0f} um max at ({:.6g}, {:.6g}, {:.6g}) m",
        1e6 * d.rms_m, 1e6 * d.p99_m, 1e6 * d.p999_m, 1e6 * d.max_m, d.p_max_M.x, d.p_max_M.y, d.p_max_M.z);
  };
  fmt::print("  deviation   full to felt {}\n              felt to full {}\n", told(r.full_to_felt),
             told(r.felt_to_full));
  fmt::print("  loop        {} near pairs (p95) under a ball of a fortieth of the diagonal; it carries {}\n",
             r.near_pairs_p95, slave_sim::kMostNearPairs);
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

std::string model_names() {
  std::string names;
  for (const slave_sim::Model& model : slave_sim::models())
    names += fmt::format("{}{}", names.empty() ? "" : ", ", model.name);
  return names;
}

slave_sim::Openings openings_of(const Request& request) {
  return {.widest_m = slave_sim::length_m(request.close), .thickness_m = slave_sim::length_m(request.thicken)};
}

slave_sim::GivenMesh told_mesh(const Request& request, slave_sim::UnitUnsaid if_unsaid) {
  slave_sim::ProgressLine progress;
  slave_sim::GivenMesh given = slave_sim::given_mesh(
      request.mesh, request.unit, if_unsaid, openings_of(request),
      [&](const std::string& stage) { progress.show(stage); }, request.up);
  progress.clear();
  for (const std::string& line : given.told) fmt::print("{}\n", line);
  return given;
}

/// What is wrong with the mesh and what a bake would do about it: 0 where nothing is.
int check(const Request& request) {
  const slave_sim::GivenMesh given = told_mesh(request, slave_sim::UnitUnsaid::kIsGuessed);
  if (!given.refusal.empty()) return complain(given.refusal);
  fmt::print("{} {}: {} triangles\n",
             given.is_sound ? "good:" : "doubtful, see above; it would be baked so:", request.mesh,
             given.mesh.triangles.size());
  return given.is_sound ? 0 : 1;
}

/// Bakes one mesh and writes it; what a program ends with.
int bake(const Request& request, const std::string& name, const slave_sim::GivenMesh& given,
         slave_sim::BakeOptions options, const std::string& out) {
  const geometry::TriangleMesh& mesh = given.mesh;
  if (!request.texture.empty())
    options.texture =
        request.texture == "auto" ? slave_sim::kTextureAuto : static_cast<std::uint32_t>(std::stoul(request.texture));

  const bool is_searched = request.model.empty() && !request.triangles && request.texture.empty();
  slave_sim::Foreseen takes = slave_sim::foreseen(mesh.triangles.size(), options.texture, 1);
  const double allowed =
      request.memory_bytes > 0 ? static_cast<double>(request.memory_bytes) : slave_sim::memory_there();
  std::uint32_t most_texture = slave_sim::kMostTexture;
  if (is_searched) {  // larger textures are rare
    most_texture = slave_sim::texture_within(allowed, mesh.triangles.size(), most_texture).value_or(most_texture);
    takes = {.bytes = slave_sim::foreseen(mesh.triangles.size(), most_texture, 1).bytes,
             .seconds = slave_sim::foreseen(mesh.triangles.size(), options.texture, slave_sim::kMostTrials).seconds};
  }
  fmt::print("takes up to {}\n", slave_sim::in_words(takes));
  if (request.memory_bytes > 0 && takes.bytes > allowed)
    return complain(fmt::format(
        "nothing is baked: {} may take {:.2g} GB and --memory allows {:.2g} GB; {}fewer triangles in the file or more "
        "--memory would do",
        name, takes.bytes / 1e9, allowed / 1e9, is_searched ? "" : "a smaller --texture, "));
  if (most_texture < slave_sim::kMostTexture)
    fmt::print("mind: textures up to {} are tried and not up to {}, as memory allows\n", most_texture,
               slave_sim::kMostTexture);
  if (const auto words = slave_sim::words_about_memory(takes)) fmt::print("mind: {}\n", *words);
  slave_sim::ProgressLine line;
  const slave_sim::Progress show = [&line](const std::string& stage, double done) { line.show(stage, done); };
  tl::expected<slave_sim::Baked, slave_sim::BakeError> baked;
  std::string verdict;
  if (!is_searched) {
    baked = slave_sim::bake_asset(name, mesh, options, show);
  } else {
    const double rms_m = request.error.empty() ? slave_sim::error_unasked_m(mesh) : *slave_sim::length_m(request.error);
    fmt::print("up to {} bakes are tried for {:.3g} um rms{}\n", slave_sim::kMostTrials, 1e6 * rms_m,
               request.error.empty() ? ", 0.03 % of its diagonal; --error asks for another" : "");
    auto within = slave_sim::bake_within(name, mesh, options, rms_m, show, slave_sim::kMostNearPairs, most_texture);
    if (within) {
      verdict = within->verdict;
      baked = std::move(within->baked);
    } else {
      baked = tl::unexpected(within.error());
    }
  }
  if (baked) line.show("colours and file");
  line.clear();
  if (!baked) return complain(baked.error().message);
  print(name, baked->report);
  if (!verdict.empty()) fmt::print("  error       {}\n", verdict);
  if (const auto words = slave_sim::words_about_deviation(baked->report)) {
    if (!request.accepts_error)
      return complain(fmt::format("nothing is written: {}; --accept-error writes it as it is", *words));
    fmt::print("MIND: {}\n", *words);
  }
  codecs::Asset& asset = baked->asset;
  std::vector<glm::dvec3> drawn_M = asset.visible.positions_O;
  for (glm::dvec3& p : drawn_M) p -= asset.p_OM_O;
  asset.visible_colours = slave_sim::colours_at(drawn_M, given.in_file.positions_O, given.colours);
  if (!given.colours.empty()) fmt::print("  colours     those of the file's vertices, for pictures and viewers\n");
  if (const auto written = codecs::write_asset_file(baked->asset, out); !written)
    return complain(written.error().message);
  fmt::print("wrote {}; to feel it: farfeel loopback --object {}\n", out, out);
  return 0;
}

int bake_given(const Request& request, const std::string& name, slave_sim::GivenMesh given, const std::string& out) {
  slave_sim::BakeOptions options;
  options.left_out = std::move(given.left_out);
  options.coarse_triangles = request.triangles.value_or(options.coarse_triangles);
  options.density_kg_per_m3 = request.density_kg_per_m3;
  options.material = request.material;
  options.height_step_m = slave_sim::error_unasked_m(given.mesh) / slave_sim::kHeightSteps;
  return bake(request, name, given, options, out);
}

int run(const Request& request) {
  if (!request.model.empty()) {
    const slave_sim::Model* model = slave_sim::find_model(request.model);
    if (model == nullptr) return complain(slave_sim::no_such_model(request.model));
    slave_sim::GivenMesh given;
    given.mesh = model->full_mesh();
    return bake(request, request.model, given, slave_sim::model_bake_options(*model), request.out);
  }
  slave_sim::GivenMesh given = told_mesh(request, slave_sim::UnitUnsaid::kIsAsked);
  if (!given.refusal.empty()) return complain(given.refusal);
  return bake_given(request, std::filesystem::path(request.mesh).stem().string(), std::move(given), request.out);
}

/// All parts are looked at before the first is baked.
int bake_parts(const Request& request) {
  auto parts = codecs::read_mesh_parts(request.mesh);
  if (!parts) return complain(parts.error().message);
  slave_sim::turn_up(*parts, request.up);
  const std::vector<std::string> names = slave_sim::asset_names(*parts);
  std::vector<slave_sim::GivenMesh> given;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string called =
        fmt::format("{}, part {}", request.mesh, std::filesystem::path(names[i]).stem().string());
    fmt::print("{}\n", called);
    slave_sim::ProgressLine progress;
    given.push_back(slave_sim::given_mesh(parts->shapes[i], called, request.unit, slave_sim::UnitUnsaid::kIsAsked,
                                          openings_of(request),
                                          [&](const std::string& stage) { progress.show(stage); }));
    progress.clear();
    for (const std::string& line : given.back().told) fmt::print("  {}\n", line);
    if (!given.back().refusal.empty()) return complain(given.back().refusal);
  }
  const std::filesystem::path folder = request.out, scene = folder / "scene.toml";
  std::error_code error;
  for (const std::string& asset : names) {
    if (std::filesystem::equivalent(request.mesh, folder / asset, error))
      return complain(fmt::format("-o {} would overwrite {} itself by the part of that name; name another folder",
                                  request.out, request.mesh));
  }
  std::filesystem::create_directories(folder, error);
  if (error)
    return complain(
        fmt::format("cannot make the folder {}: {}; -o names a folder with --parts", request.out, error.message()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = std::filesystem::path(names[i]).stem().string();
    if (const int failed = bake_given(request, name, std::move(given[i]), folder / names[i]); failed != 0)
      return failed;
  }
  const double unit_m = request.unit.empty() ? 1 : *slave_sim::metres_per_unit(request.unit);
  const std::string title = std::filesystem::path(request.mesh).stem().string();
  if (const std::string wrong =
          codecs::write_whole_file(scene, slave_sim::scene_of_parts(*parts, names, title, unit_m));
      !wrong.empty())
    return complain(wrong);
  fmt::print("wrote {} parts and {}; to feel them: farfeel loopback --scene {}\n", parts->parts.size(), scene.string(),
             scene.string());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "farfeel-bake: makes a haptic asset (.glb) of a triangle mesh: what can be felt, and drawn by any viewer",
      "farfeel-bake");
  Request request;
  auto* mesh =
      app.add_option("mesh", request.mesh,
                     "A closed surface: .obj, .off, .ply, .stl, .glb or .gltf; small faults are repaired, and said")
          ->check(CLI::ExistingFile);
  auto* model = app.add_option("--model", request.model, "A built-in model instead of a file: " + model_names());
  mesh->excludes(model);
  app.add_option("-o,--output", request.out, "The asset to write, a .glb; with --parts a folder")->configurable(false);
  app.add_flag("--check", request.is_check,
               "Write nothing: say what is wrong with the mesh, how often, where first, and what a bake does about it; "
               "0 where nothing is, else 1")
      ->excludes(model)
      ->configurable(false);
  app.add_flag(
         "--parts", request.is_parts,
         "Each part of the file an asset of its own, in the folder -o, and a scene.toml with all of them in their "
         "places: a glTF's nodes with meshes, an OBJ's objects, or its groups")
      ->excludes(model)
      ->configurable(false);
  app.add_option(
         "--unit", request.unit,
         "What one unit of the file is: m, cm, mm, um, in, ft, or metres as a number; unsaid, metres, if a hand "
         "can hold that")
      ->check(slave_sim::complaint_about_unit);
  app.add_option(
         "--up", request.up,
         "Which axis of the file points up: x, y or z; unsaid, z, as in scenes and pictures, and nothing is turned")
      ->excludes(model)
      ->check(slave_sim::complaint_about_axis);
  auto* triangles =
      app.add_option(
             "--triangles", request.triangles,
             "Instead of an error: aim for the coarse mesh that contacts are looked for on; with --texture alone "
             "700")
          ->check(CLI::Range(4U, 100'000U));
  auto* texture =
      app.add_option(
             "--texture", request.texture,
             "Instead of an error: texels, as the side of a square that holds them all, 16 to 16384; or auto: what the "
             "surface needs; with --triangles alone 1024")
          ->check([](const std::string& side) {
            const bool is_number =
                !side.empty() && side.size() < 6 &&
                std::all_of(side.begin(), side.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
            const bool is_good = side == "auto" || (is_number && std::stoul(side) >= 16 && std::stoul(side) <= 16384);
            return is_good ? std::string() : side + " is neither auto nor 16 to 16384";
          });
  app.add_option(
         "--error", request.error,
         "How far what is felt may be from the mesh, rms, as 50um or 0.05mm; unsaid, 0.03 % of its diagonal. It takes "
         "few triangles and texels for that, within what the haptic loop carries, and says which of the two ruled")
      ->excludes(triangles)
      ->excludes(texture)
      ->excludes(model)
      ->check(slave_sim::complaint_about_length);
  app.add_option(
         "--close", request.close,
         "Up to what width openings are filled, as 5mm; unsaid, a third of the mesh's size, and with --thicken none")
      ->excludes(model)
      ->check(slave_sim::complaint_about_length);
  app.add_option(
         "--thicken", request.thicken,
         "How thick a sheet is that ends in an open border, as 0.5mm: it gets a back, behind what is given; unsaid, it "
         "is refused")
      ->excludes(model)
      ->check(slave_sim::complaint_about_length);
  app.add_flag(
         "--accept-error", request.accepts_error,
         "Write the asset even where what is felt is farther from the mesh, rms, than 2 % of its median thickness")
      ->configurable(false);
  app.add_option(
         "--memory", request.memory_bytes,
         "At most so much memory, as 2GB: a bake that may take more goes with smaller textures, or is refused before "
         "it begins; unsaid, what there is, and what may take more is told")
      ->transform(CLI::AsSizeValue(true));
  app.add_option("--density", request.density_kg_per_m3, "For mass and inertia [kg/m^3]")
      ->check(CLI::Range(1.0, 1e5))
      ->capture_default_str();
  app.add_option("--stiffness", request.material.stiffness_N_per_m, "Of the surface [N/m]")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--damping", request.material.damping_Ns_per_m, "Of the surface [N s/m]")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str();
  app.add_option("--static-friction", request.material.static_friction, "Coefficient at rest")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  app.add_option("--dynamic-friction", request.material.dynamic_friction, "Coefficient in motion")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  app.footer(
      "Example:\n  farfeel bake part.stl --unit mm --check\n  farfeel bake part.stl --unit mm -o part.glb\n  farfeel "
      "loopback --object part.glb");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  if (request.mesh.empty() == request.model.empty())
    return misused("name a mesh file, or --model and a benchmark model");
  if (request.is_check && request.is_parts) return misused("--check looks at a file as a whole: leave --parts out");
  if (request.is_check) return check(request);
  if (request.out.empty()) return misused("name the asset to write: -o part.glb");
  if (request.is_parts) return bake_parts(request);
  const auto target = codecs::target_of(request.out);
  if (!target) return complain(target.error().message);
  std::error_code ignored;
  if (!request.mesh.empty() && std::filesystem::equivalent(request.mesh, *target, ignored))
    return complain(fmt::format("-o {} would overwrite the mesh itself; name another file", request.out));
  return run(request);
}
