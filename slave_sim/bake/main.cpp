// farfeel-bake: any closed triangle mesh, or a benchmark model, becomes a haptic asset.
#include <fmt/format.h>

#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdio>

#include "slave_sim/bake/asset_cache.h"

namespace {

using namespace farfeel;

void print(const slave_sim::BakeReport& r) {
  fmt::print("  triangles   {} -> {} coarse in {} convex pieces, {} charts, {} tiles\n", r.full_triangles,
             r.coarse_triangles, r.pieces, r.charts, r.tiles);
  fmt::print("  texel       {:.1f} um; {} texels, {} missed\n", 1e6 * r.texel_m, r.texels, r.missed_texels);
  fmt::print("  deviation   full to felt {:.1f} um rms, {:.1f} um max; felt to full {:.1f} um rms, {:.1f} um max\n",
             1e6 * r.full_to_felt.rms_m, 1e6 * r.full_to_felt.max_m, 1e6 * r.felt_to_full.rms_m,
             1e6 * r.felt_to_full.max_m);
  double seconds = 0;
  fmt::print("  time       ");
  for (const auto& stage : r.stages) {
    seconds += stage.seconds;
    fmt::print(" {} {:.2f} s", stage.stage, stage.seconds);
  }
  fmt::print(", together {:.2f} s\n", seconds);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bakes a mesh into a haptic asset (.glb)");
  std::string model_name, out_path;
  slave_sim::BakeOptions options;
  app.add_option("--model", model_name, "a benchmark model")->required();
  app.add_option("-o,--output", out_path, "the asset to write")->required();
  app.add_option("--texture", options.texture, "side of the square that has as many texels as the asset may use");
  app.add_option("--piece-tolerance", options.piece_tolerance_m, "metres");
  CLI11_PARSE(app, argc, argv);
  const slave_sim::Model* model = slave_sim::find_model(model_name);
  if (model == nullptr) {
    fmt::print(stderr, "farfeel-bake: there is no model {}\n", model_name);
    return 2;
  }
  const std::uint32_t texture = options.texture;
  options = slave_sim::model_bake_options(*model);
  options.texture = texture;
  const auto baked = slave_sim::bake_asset(model_name, model->full_mesh(), options, {});
  if (!baked) {
    fmt::print(stderr, "farfeel-bake: {}\n", baked.error().message);
    return 1;
  }
  fmt::print("{}\n", model_name);
  print(baked->report);
  if (const auto written = codecs::write_asset_file(baked->asset, out_path); !written) {
    fmt::print(stderr, "farfeel-bake: {}\n", written.error().message);
    return 1;
  }
  return 0;
}
