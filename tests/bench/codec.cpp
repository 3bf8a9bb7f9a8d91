// farfeel-bench codec: what meshes, height tiles and messages take as bytes and time, beside other ways to send them.
// Codecs of one input take turns, so that a busy machine is as hard on each; times are medians of the thread's own.
#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "codecs/mesh/draco_mesh.h"
#include "codecs/tile/tile_codec.h"
#include "codecs/wire/course_message.h"
#include "codecs/wire/pose_message.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/bake/full_surface.h"
#include "slave_sim/models/models.h"
#include "tests/bench/bench.h"
#include "tests/bench/mesh_codecs.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/touch_models.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using Bytes = std::vector<std::byte>;
using nlohmann::json;

constexpr double kMostAbovePlain = 1.13;       // of a scan's bytes, over Draco's at equal error
constexpr double kInOneDatagram = 0.99;        // of tiles
constexpr std::size_t kMostTiles = 300;        // of a surface: every so many-th
constexpr std::size_t kMostVertices = 20'000;  // of which errors are measured
constexpr int kTileLevel = 1;                  // of zstd: small inputs, at the rate of a hand

struct Options {
  std::string scans = "../shared/models";
  int rounds = 5;
  bool is_quick = false, as_json = false;
};

double thread_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

/// How long an action takes, and what it gives.
template <typename Action>
auto timed(std::vector<double>& us, const Action& action) {
  const double begin_us = thread_us();
  auto result = action();
  us.push_back(thread_us() - begin_us);
  return result;
}

struct Row {
  std::string codec, input;
  double bytes = 0, encode_us = 0, decode_us = 0, error_um = 0;
  json more = json::object();
};

class Table {
 public:
  void add(Row row) {
    fmt::print("{:<16}{:<20}{:>11.1f}{:>11.2f}{:>11.2f}{:>10.3f}  {}\n", row.codec, row.input, row.bytes, row.encode_us,
               row.decode_us, row.error_um, row.more.empty() ? "" : row.more.dump());
    std::fflush(stdout);
    json told{{"codec", row.codec},         {"input", row.input},         {"bytes", row.bytes},
              {"encode_us", row.encode_us}, {"decode_us", row.decode_us}, {"error_um", row.error_um}};
    told.update(row.more);
    rows_.push_back(std::move(told));
  }
  [[nodiscard]] const json& rows() const { return rows_; }

 private:
  json rows_ = json::array();
};

/// The most that one of the mesh's vertices is off the other surface.
double most_off_m(const geometry::TriangleMesh& mesh, const geometry::TriangleMesh& other) {
  const slave_sim::FullSurface surface(other);
  const std::size_t every = (mesh.positions_O.size() + kMostVertices - 1) / kMostVertices;
  double most_m = 0;
  for (std::size_t i = 0; i < mesh.positions_O.size(); i += every)
    most_m = std::max(most_m, surface.distance_m(mesh.positions_O[i]));
  return most_m;
}

/// Bytes over those of Draco at its best.
double measure_mesh(const std::string& input, const geometry::TriangleMesh& mesh, int rounds, Table& table) {
  const std::vector<MeshCodec> all = mesh_codecs();
  std::vector<std::vector<double>> encode_us(all.size()), decode_us(all.size());
  std::vector<Bytes> coded(all.size());
  std::vector<geometry::TriangleMesh> back(all.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      coded[k] = timed(encode_us[k], [&] { return all[k].encode(mesh); });
      if (coded[k].empty()) throw CLI::RuntimeError(all[k].name + " refuses " + input, 1);
      back[k] = timed(decode_us[k], [&] { return all[k].decode(coded[k]); });
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    table.add({all[k].name,
               input,
               static_cast<double>(coded[k].size()),
               support::quantile(encode_us[k], 0.5),
               support::quantile(decode_us[k], 0.5),
               1e6 * most_off_m(mesh, back[k]),
               {{"triangles", mesh.triangles.size()}}});
  }
  return static_cast<double>(coded[0].size()) / static_cast<double>(coded[1].size());
}

/// A way to send a tile: parts, each in a datagram, and how far the coefficients that come out are off at most.
struct TileCodec {
  std::string name;
  std::function<std::vector<Bytes>(std::uint32_t, const geometry::HeightTile&)> encode;
  std::function<int(const std::vector<Bytes>&, const geometry::HeightTile&)> most_off;
};

int off_of_parts(const std::vector<Bytes>& parts, const geometry::HeightTile& tile) {
  int most = 0;
  for (const Bytes& bytes : parts) {
    const auto part = codecs::decoded_tile_part(bytes).value();
    const std::uint16_t* const true_ones = &tile.coefficients[part.first_row * geometry::kTileSide];
    for (std::size_t k = 0; k < part.rows * geometry::kTileSide; ++k)
      most = std::max(most, std::abs(part.coefficients[k] - true_ones[k]));
  }
  return most;
}

std::vector<TileCodec> tile_codecs(const geometry::HapticSurface& surface) {
  std::vector<TileCodec> all{
      {"tile_exact",
       [](std::uint32_t i, const geometry::HeightTile& tile) { return encoded_tile(i, tile, codecs::kExactly); },
       off_of_parts},
      {"tile_near",
       [within = codecs::nearness(surface)](std::uint32_t i, const geometry::HeightTile& tile) {
         return encoded_tile(i, tile, within, codecs::kWorthBytes);
       },
       off_of_parts},
      {"tile_raw",
       [](std::uint32_t, const geometry::HeightTile& tile) {
         const auto bytes = std::as_bytes(std::span(tile.coefficients));
         return std::vector<Bytes>{{bytes.begin(), bytes.end()}};
       },
       [](const std::vector<Bytes>& parts, const geometry::HeightTile& tile) {
         return std::memcmp(parts[0].data(), tile.coefficients.data(), parts[0].size()) == 0 ? 0 : 65535;
       }}};
  if (!has_zstd()) return all;
  all.push_back({"tile_raw_zstd",
                 [](std::uint32_t, const geometry::HeightTile& tile) {
                   return std::vector<Bytes>{zstd_packed(std::as_bytes(std::span(tile.coefficients)), kTileLevel)};
                 },
                 [](const std::vector<Bytes>& parts, const geometry::HeightTile& tile) {
                   const Bytes unpacked = zstd_unpacked(parts[0]);
                   return std::memcmp(unpacked.data(), tile.coefficients.data(), unpacked.size()) == 0 ? 0 : 65535;
                 }});
  return all;
}

/// The share of tiles that go as they are sent into one datagram.
double measure_tiles(const std::string& input, const geometry::HapticSurface& surface, int rounds, Table& table) {
  double share_as_sent = 0;
  const auto every = static_cast<std::uint32_t>((surface.tiles.size() + kMostTiles - 1) / kMostTiles);
  const std::vector<TileCodec> all = tile_codecs(surface);
  std::vector<std::vector<double>> encode_us(all.size()), decode_us(all.size()), bytes(all.size());
  std::vector<int> most(all.size(), 0), in_one(all.size(), 0);
  for (int round = 0; round < rounds; ++round) {
    for (std::uint32_t i = 0; i < surface.tiles.size(); i += every) {
      for (std::size_t k = 0; k < all.size(); ++k) {
        const auto parts = timed(encode_us[k], [&] { return all[k].encode(i, surface.tiles[i]); });
        most[k] = std::max(most[k], timed(decode_us[k], [&] { return all[k].most_off(parts, surface.tiles[i]); }));
        if (round > 0) continue;
        std::size_t sum = 0;
        for (const Bytes& part : parts) sum += part.size();
        bytes[k].push_back(static_cast<double>(sum));
        in_one[k] += parts.size() == 1 && sum <= codecs::kMostPartBytes ? 1 : 0;
      }
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    double sum = 0;
    for (const double each : bytes[k]) sum += each;
    const auto tiles = static_cast<double>(bytes[k].size());
    const double share = in_one[k] / tiles;
    if (all[k].name == "tile_near") share_as_sent = share;
    table.add({all[k].name,
               input,
               sum / tiles,
               support::quantile(encode_us[k], 0.5),
               support::quantile(decode_us[k], 0.5),
               1e6 * most[k] * surface.scale.scale_m,
               {{"tiles", bytes[k].size()},
                {"p99_bytes", support::quantile(bytes[k], 0.99)},
                {"one_datagram_share", share}}});
  }
  return share_as_sent;
}

/// A message's time is too short for a clock: of so many in a row.
constexpr int kBatch = 1000;

spatial::Pose some_pose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> along(-0.1, 0.1), turn(-1, 1);
  return {spatial::rotation_from_vector({turn(random), turn(random), turn(random)}),
          {along(random), along(random), along(random)}};
}

void measure_messages(int rounds, Table& table) {
  std::mt19937_64 random(1);
  std::vector<codecs::PoseMessage> poses(kBatch);
  std::vector<motion::ObjectCourse> courses(kBatch);
  for (int i = 0; i < kBatch; ++i) {
    poses[i].time_us = 1000 * i;
    poses[i].X_WT = some_pose(random);
    poses[i].heard = static_cast<std::uint16_t>(i);
    courses[i] = {static_cast<std::uint32_t>(i), {1, 2.0, 0.5, some_pose(random), some_pose(random), true}};
  }
  codecs::PoseWriter writer;
  writer.reset(codecs::grid_around({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}));
  std::vector<std::array<std::byte, 256>> sent(kBatch);
  std::vector<std::size_t> sizes(kBatch);
  std::vector<double> pose_us[2], course_us[2];
  double pose_off_m = 0, course_off_m = 0, pose_bytes = 0, course_bytes = 0;
  for (int round = 0; round < 20 * rounds; ++round) {
    (void)timed(pose_us[0], [&] {
      for (int i = 0; i < kBatch; ++i) sizes[i] = writer.write(poses[i], sent[i]);
      return 0;
    });
    pose_bytes = static_cast<double>(sizes[0]);
    codecs::PoseMessage back;
    pose_off_m =
        std::max(pose_off_m, timed(pose_us[1], [&] {
                   double most_m = 0;
                   for (int i = 0; i < kBatch; ++i) {
                     if (codecs::read(std::span(sent[i]).first(sizes[i]), writer.grid(), back) != codecs::Fault::kNone)
                       throw CLI::RuntimeError("a pose message is not read again", 1);
                     most_m = std::max(most_m, glm::distance(back.X_WT.p, poses[i].X_WT.p));
                   }
                   return most_m;
                 }));
    (void)timed(course_us[0], [&] {
      for (int i = 0; i < kBatch; ++i) sizes[i] = codecs::write(courses[i], sent[i]);
      return 0;
    });
    course_bytes = static_cast<double>(sizes[0]);
    course_off_m =
        std::max(course_off_m, timed(course_us[1], [&] {
                   double most_m = 0;
                   for (int i = 0; i < kBatch; ++i) {
                     const auto read = codecs::read_course(std::span(sent[i]).first(sizes[i]));
                     if (!read) throw CLI::RuntimeError("a course is not read again", 1);
                     most_m = std::max(most_m, glm::distance(read->course.X_to_WO.p, courses[i].course.X_to_WO.p));
                   }
                   return most_m;
                 }));
  }
  const auto each_us = [](const std::vector<double>& us) { return support::quantile(us, 0.5) / kBatch; };
  table.add({"pose", "message", pose_bytes, each_us(pose_us[0]), each_us(pose_us[1]), 1e6 * pose_off_m});
  table.add({"course", "message", course_bytes, each_us(course_us[0]), each_us(course_us[1]), 1e6 * course_off_m});
}

geometry::HapticSurface felt_of(const slave_sim::Model& model, geometry::TriangleMesh& drawn) {
  auto asset = slave_sim::cached_model_asset(model.name);
  if (!asset) throw CLI::RuntimeError(asset.error().message, 1);
  drawn = std::move(asset->visible);
  return std::move(asset->felt);
}

void run(const Options& options) {
  const int rounds = options.is_quick ? 1 : options.rounds;
  if (!has_zstd()) fmt::print("without libzstd (libzstd-dev) at the build: nothing under zstd is measured\n");
  fmt::print("{:<16}{:<20}{:>11}{:>11}{:>11}{:>10}\n", "codec", "input", "bytes", "encode us", "decode us", "error um");
  Table table;
  std::map<std::string, double> above_plain, in_one;
  const auto models = slave_sim::models();
  for (std::size_t k = 0; k < (options.is_quick ? 1 : models.size()); ++k) {
    const std::string name(models[k].name);
    geometry::TriangleMesh drawn;
    const geometry::HapticSurface felt = felt_of(models[k], drawn);
    (void)measure_mesh(name, drawn, rounds, table);
    if (felt.is_textured()) in_one[name] = measure_tiles(name, felt, rounds, table);
  }
  for (const auto& scene : stroked_scenes(options.is_quick ? SceneChoice::kOne : SceneChoice::kAll))
    in_one[scene->name()] = measure_tiles(scene->name(), scene->surface(1), rounds, table);
  for (const TouchModel& model : touch_models(options.scans)) {
    std::error_code ignored;
    if (options.is_quick || model.scan.empty() || !std::filesystem::exists(model.scan, ignored)) continue;
    const auto scan = touch_mesh(model);
    if (!scan) throw CLI::RuntimeError(scan.error(), 1);
    above_plain[model.name] = measure_mesh(model.name, scan->mesh, rounds, table);
  }
  measure_messages(rounds, table);
  const auto most = [](const auto& a, const auto& b) { return a.second < b.second; };
  json goals;
  if (!above_plain.empty()) {
    const auto worst = std::ranges::max_element(above_plain, most);
    fmt::print("\na scan over Draco's smallest of the same grid: {:.3f} at most ({}); goal {:.2f}: {}\n", worst->second,
               worst->first, kMostAbovePlain, worst->second <= kMostAbovePlain ? "kept" : "MISSED");
    goals["scan_over_plain_draco"] = worst->second;
  }
  const auto fewest = std::ranges::min_element(in_one, most);
  fmt::print("tiles in one datagram: {:.4f} at least ({}); goal {:.2f}: {}\n", fewest->second, fewest->first,
             kInOneDatagram, fewest->second >= kInOneDatagram ? "kept" : "MISSED");
  goals["tiles_in_one_datagram"] = fewest->second;
  if (options.as_json) fmt::print("{}\n", json{{"rows", table.rows()}, {"goals", goals}}.dump());
}

}  // namespace

void add_codec(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand(
      "codec", "What meshes, height tiles and messages take as bytes and time, beside meshoptimizer, zstd and raw");
  app->add_option("--scans", options->scans, "a folder of .obj scans")->capture_default_str();
  app->add_option("--rounds", options->rounds, "of which times are medians")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app->add_flag("--quick", options->is_quick, "one model, one surface, one round");
  app->add_flag("--json", options->as_json, "one JSON object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
