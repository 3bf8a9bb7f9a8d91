// What height tiles take: bits a texel at several bounds on the height, and the time to write and read one.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "codecs/tile/coarse_level.h"
#include "codecs/tile/tile_codec.h"
#include "haptic_core/geometry/coarse_heights.h"
#include "slave_sim/bake/asset_cache.h"
#include "tests/bench/bench.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

constexpr std::size_t kMostTiles = 300;  // of a surface: every so many-th
struct Bound {
  double height_m, slope;
  std::size_t worth_bytes = 0;  ///< finer than that up to so many
};
constexpr Bound kSent{codecs::kHeightsWithin_m, codecs::kSlopesWithin, codecs::kWorthBytes};
constexpr double kAnySlope = 1;
constexpr std::array<Bound, 6> kBounds{
    {{0, 0}, {0.25e-6, kAnySlope}, {0.5e-6, kAnySlope}, {1e-6, kAnySlope}, {kSent.height_m, kSent.slope}, kSent}};

double thread_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

struct TileFigures {
  Bound bound{};
  double bytes = 0, bits_a_texel = 0, smooth_share = 0;
  double off_m = 0;  ///< greatest error of a coefficient, hence of a height
  double write_us = 0, read_us = 0;
};

TileFigures measured(const geometry::HapticSurface& surface, const Bound& bound) {
  const std::size_t every = (surface.tiles.size() + kMostTiles - 1) / kMostTiles;
  const codecs::Nearness within = codecs::nearness(surface, bound.height_m, bound.slope);
  TileFigures figures{.bound = bound};
  int count = 0, most = 0;
  for (std::uint32_t i = 0; i < surface.tiles.size(); i += static_cast<std::uint32_t>(every), ++count) {
    const double begin_us = thread_us();
    const auto parts = codecs::encoded_tile(i, surface.tiles[i], within, bound.worth_bytes);
    const double written_us = thread_us();
    for (const auto& bytes : parts) {
      const auto part = codecs::decoded_tile_part(bytes).value();
      const std::uint16_t* true_ones = &surface.tiles[i].coefficients[part.first_row * geometry::kTileSide];
      for (std::size_t k = 0; k < part.rows * geometry::kTileSide; ++k)
        most = std::max(most, std::abs(part.coefficients[k] - true_ones[k]));
      figures.bytes += static_cast<double>(bytes.size());
    }
    figures.read_us += thread_us() - written_us;
    figures.write_us += written_us - begin_us;
    figures.smooth_share += parts[0][0] == std::byte{4};
  }
  for (double* sum : {&figures.bytes, &figures.read_us, &figures.write_us, &figures.smooth_share}) *sum /= count;
  figures.bits_a_texel = 8 * figures.bytes / (geometry::kTileTexels * geometry::kTileTexels);
  figures.off_m = most * surface.scale.scale_m;
  return figures;
}

/// The level that stands in for tiles until they are here.
struct LevelFigures {
  double bytes_a_tile = 0;
  double off_p50_m = 0, off_p95_m = 0, off_max_m = 0;  ///< of the tiles' bounds
};

LevelFigures level_of(const geometry::HapticSurface& surface) {
  const geometry::CoarseHeights level = geometry::coarse_heights(surface);
  LevelFigures figures;
  figures.bytes_a_tile =
      static_cast<double>(codecs::encoded_coarse_level(surface, level).size()) / static_cast<double>(level.off.size());
  const double step_m = geometry::coarse_step(surface.scale) * surface.scale.scale_m;
  const auto quantile_m = [&](double share) { return step_m * support::quantile(level.off, share); };
  figures.off_p50_m = quantile_m(0.5), figures.off_p95_m = quantile_m(0.95), figures.off_max_m = quantile_m(1);
  return figures;
}

struct Options {
  bool as_json = false;
};

void run(const Options& options) {
  nlohmann::json rows = nlohmann::json::array(), levels = nlohmann::json::array();
  fmt::print("{:15} {:>6} {:>9} {:>8} {:>8} {:>9} {:>6} {:>9} {:>10} {:>7} {:>7} {:>9} {:>8}\n", "surface", "tiles",
             "texel um", "step nm", "bound nm", "slope e-3", "worth", "bytes", "bits/texel", "smooth", "off nm",
             "write us", "read us");
  std::string level_table;
  const auto tell = [&](const std::string& name, const geometry::HapticSurface& surface) {
    const LevelFigures level = level_of(surface);
    level_table += fmt::format("{:15} {:6} {:9.1f} {:9.2f} {:9.1f} {:9.1f} {:9.1f}\n", name, surface.tiles.size(),
                               1e6 * surface.charts[0].texel_m, level.bytes_a_tile, 1e6 * level.off_p50_m,
                               1e6 * level.off_p95_m, 1e6 * level.off_max_m);
    levels.push_back({{"surface", name},
                      {"bytes_a_tile", level.bytes_a_tile},
                      {"off_p50_um", 1e6 * level.off_p50_m},
                      {"off_p95_um", 1e6 * level.off_p95_m},
                      {"off_max_um", 1e6 * level.off_max_m}});
    for (const Bound& bound : kBounds) {
      const TileFigures f = measured(surface, bound);
      fmt::print("{:15} {:6} {:9.1f} {:8.1f} {:8.0f} {:9.1f} {:6} {:9.1f} {:10.2f} {:7.2f} {:7.0f} {:9.1f} {:8.1f}\n",
                 name, surface.tiles.size(), 1e6 * surface.charts[0].texel_m, 1e9 * surface.scale.scale_m,
                 1e9 * bound.height_m, 1e3 * bound.slope, bound.worth_bytes, f.bytes, f.bits_a_texel, f.smooth_share,
                 1e9 * f.off_m, f.write_us, f.read_us);
      rows.push_back({{"surface", name},
                      {"bound_nm", 1e9 * bound.height_m},
                      {"bound_slope", bound.slope},
                      {"worth_bytes", bound.worth_bytes},
                      {"bytes_a_tile", f.bytes},
                      {"bits_a_texel", f.bits_a_texel},
                      {"smooth_share", f.smooth_share},
                      {"off_nm", 1e9 * f.off_m},
                      {"write_us", f.write_us},
                      {"read_us", f.read_us}});
    }
  };
  for (const auto& scene : stroked_scenes(SceneChoice::kAll)) tell(scene->name(), scene->surface(1));
  for (const slave_sim::Model& model : slave_sim::models()) {
    const auto asset = slave_sim::cached_model_asset(model.name);
    if (!asset) throw CLI::RuntimeError(asset.error().message, 1);
    tell(std::string(model.name), asset->felt);
  }
  fmt::print("\nwhat stands in for tiles until they are here, and its bound of each tile\n");
  fmt::print("{:15} {:>6} {:>9} {:>9} {:>9} {:>9} {:>9}\n{}", "surface", "tiles", "texel um", "B a tile", "p50 um",
             "p95 um", "max um", level_table);
  if (options.as_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}, {"levels", levels}}.dump());
}

}  // namespace

void add_tiles(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("tiles", "What height tiles take: bits a texel, and time to write and read one");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
