// farfeel-asset: what is in an asset, in figures or as a picture.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "codecs/settings/command_line.h"
#include "deploy/asset/asset_views.h"
#include "deploy/asset/deviation_views.h"
#include "slave_sim/bake/given_mesh.h"
#include "slave_sim/bake/left_out.h"
#include "slave_sim/bake/unit_of_length.h"
#include "slave_sim/bake/up_axis.h"

namespace farfeel::asset_views {
namespace {

struct PictureRequest {
  std::string path, out = "asset.png", mesh, unit, up, close, thicken;
  int height_px = 700;
};

int fail(const std::string& message) {
  fmt::print(stderr, "{}\n", message);
  return 1;
}

void print_pieces(const codecs::Asset& asset) {
  const codecs::HullBreaches& b = asset.breaches;
  const std::vector<double>& thickness_m = asset.felt.piece_thickness_m;
  double least_m = std::numeric_limits<double>::infinity();
  for (const double t : thickness_m) least_m = t > 0 ? std::min(least_m, t) : least_m;
  const std::string thinnest = std::isfinite(least_m)
                                   ? fmt::format("the thinnest has {:.2f} mm of material behind it", least_m * 1e3)
                                   : std::string("how thick they are is unknown");
  fmt::print("pieces     {}; {} leave the solid (worst {:.0f} um), {} pass its middle (worst {:.0f} um)\n", thinnest,
             b.outside, b.worst_outside_m * 1e6, b.past_middle, b.worst_past_middle_m * 1e6);
}

void print_felt(const geometry::HapticSurface& felt) {
  fmt::print("felt       {} coarse triangles in {} convex pieces\n", felt.coarse.triangles.size(), felt.piece_count);
  if (!felt.is_textured()) {
    fmt::print("texture    none: felt as the coarse mesh\n");
    return;
  }
  double finest_m = felt.charts.front().texel_m, coarsest_m = finest_m;
  for (const geometry::Chart& chart : felt.charts) {
    finest_m = std::min(finest_m, chart.texel_m);
    coarsest_m = std::max(coarsest_m, chart.texel_m);
  }
  fmt::print("texture    {} charts, {} tiles of {} x {}; texel {:.1f} um{}; one step of height {:.3f} um\n",
             felt.charts.size(), felt.tiles.size(), geometry::kTileSide, geometry::kTileSide, finest_m * 1e6,
             coarsest_m > finest_m ? fmt::format(" to {:.1f} um", coarsest_m * 1e6) : "", felt.scale.scale_m * 1e6);
}

int info(const std::string& path) {
  const auto asset = codecs::read_asset_file(path);
  if (!asset) return fail(asset.error().message);
  const glm::dvec3 size_mm = geometry::bounding_box(asset->felt.coarse).size() * 1e3;
  const contact::Material& m = asset->material;
  std::error_code error;
  fmt::print("{}: {}, {:.2f} MB\n", path, asset->name,
             static_cast<double>(std::filesystem::file_size(path, error)) * 1e-6);
  fmt::print("size       {:.2f} x {:.2f} x {:.2f} mm\n", size_mm.x, size_mm.y, size_mm.z);
  fmt::print("drawn      {} triangles{}\n", asset->visible.triangles.size(),
             asset->visible_colours.empty() ? "" : ", in the scan's colours");
  print_felt(asset->felt);
  if (const std::size_t triangles = asset->detail.mesh.triangles.size(); triangles > 0)
    fmt::print("stored     as a mesh of {} triangles, from which charts and heights follow\n", triangles);
  print_pieces(*asset);
  fmt::print("material   stiffness {:g} N/m, damping {:g} Ns/m, friction {:g} static, {:g} dynamic\n",
             m.stiffness_N_per_m, m.damping_Ns_per_m, m.static_friction, m.dynamic_friction);
  fmt::print("mass       {:.4g} g; inertia about the centre of mass {:.3g}, {:.3g}, {:.3g} g cm^2\n",
             asset->mass_kg * 1e3, asset->inertia_O_kg_m2[0][0] * 1e7, asset->inertia_O_kg_m2[1][1] * 1e7,
             asset->inertia_O_kg_m2[2][2] * 1e7);
  fmt::print("origin     the centre of mass; the mesh's own origin is at {:.3f}, {:.3f}, {:.3f} mm\n",
             asset->p_OM_O.x * 1e3, asset->p_OM_O.y * 1e3, asset->p_OM_O.z * 1e3);
  return 0;
}

int written(const master_station::Image& image, const std::string& out) {
  const std::string bytes = master_station::png(image);
  std::ofstream file(out, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) return fail(fmt::format("could not write {}: is the folder there, and the disk not full?", out));
  return 0;
}

int draw_picture(const PictureRequest& request) {
  const auto asset = codecs::read_asset_file(request.path);
  if (!asset) return fail(asset.error().message);
  if (request.mesh.empty()) {
    const auto image = picture(*asset, request.height_px);
    if (!image) return fail(image.error().message);
    if (const int failed = written(*image, request.out); failed != 0) return failed;
    fmt::print("{}: coarse mesh, convex pieces, felt surface{}\n", request.out,
               asset->visible_colours.empty() ? "" : ", the scan's colours");
    return 0;
  }
  const slave_sim::Openings openings{.widest_m = slave_sim::length_m(request.close),
                                     .thickness_m = slave_sim::length_m(request.thicken)};
  slave_sim::GivenMesh given =
      slave_sim::given_mesh(request.mesh, request.unit, slave_sim::UnitUnsaid::kIsAsked, openings, {}, request.up);
  if (!given.refusal.empty()) return fail(given.refusal);
  slave_sim::append(given.mesh, given.left_out);
  const auto drawn = deviation_picture(*asset, given.mesh, given.in_file, request.height_px);
  if (!drawn) return fail(drawn.error().message);
  if (const int failed = written(drawn->image, request.out); failed != 0) return failed;
  fmt::print("{}: what is felt by how far it is from {}, and {} by how far it is from what is felt\n{}\n", request.out,
             request.mesh, request.mesh, drawn->legend);
  return 0;
}

}  // namespace
}  // namespace farfeel::asset_views

int main(int argc, char** argv) {
  using namespace farfeel::asset_views;
  CLI::App app{"farfeel-asset: what is in an asset (.glb), in figures or as a picture.", "farfeel-asset"};
  app.require_subcommand(1);
  std::string path;
  PictureRequest request;
  CLI::App* info_command = app.add_subcommand("info", "Print sizes, texture, material and mass");
  info_command->add_option("FILE", path, "An asset")->required()->check(CLI::ExistingFile);
  CLI::App* picture_command = app.add_subcommand(
      "picture", "Draw coarse mesh, convex pieces, felt surface and, if it has them, the scan's colours side by side");
  picture_command->add_option("FILE", request.path, "An asset")->required()->check(CLI::ExistingFile);
  picture_command->add_option("-o,--out", request.out, "The picture, a PNG")->capture_default_str();
  auto* mesh = picture_command
                   ->add_option("--mesh", request.mesh,
                                "The mesh it was baked from: draw instead where the two are apart, both ways, in "
                                "colours; pale is what the bake made up")
                   ->check(CLI::ExistingFile)
                   ->configurable(false);
  picture_command->add_option("--unit", request.unit, "What one unit of that file is, as it was said to the bake")
      ->needs(mesh)
      ->configurable(false)
      ->check([](const std::string& unit) { return farfeel::slave_sim::complaint_about_unit(unit); });
  picture_command->add_option("--up", request.up, "Which of its axes points up, likewise")
      ->needs(mesh)
      ->configurable(false)
      ->check(farfeel::slave_sim::complaint_about_axis);
  picture_command->add_option("--close", request.close, "Up to what width its openings were filled, likewise")
      ->needs(mesh)
      ->configurable(false)
      ->check(farfeel::slave_sim::complaint_about_length);
  picture_command->add_option("--thicken", request.thicken, "How thick its sheets were made, likewise")
      ->needs(mesh)
      ->configurable(false)
      ->check(farfeel::slave_sim::complaint_about_length);
  picture_command->add_option("--height", request.height_px, "Pixels")
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  app.footer(
      "Example:\n  farfeel asset picture part.glb -o part.png\n  farfeel asset picture part.glb --mesh part.stl --unit "
      "mm -o off.png");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  return info_command->parsed() ? info(path) : draw_picture(request);
}
