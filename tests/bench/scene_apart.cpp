// What it costs to decode a scene's meshes in a process apart (master_station/session/scene_apart.h), and how much
// memory that process needs, to see how far the limit is from what is right.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "master_station/session/scene_apart.h"
#include "tests/bench/bench.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

struct Options {
  std::string program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("farfeel-master").string();
  int repeats = 5;
  bool as_json = false;
};

/// A wavy sheet of 2 n n triangles.
geometry::TriangleMesh sheet(std::uint32_t n) {
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j)
      mesh.positions_O.emplace_back(0.1 * i / n, 0.1 * j / n, 0.003 * std::sin(0.31 * i) * std::cos(0.17 * j));
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

/// Every triangle with corners of its own: what a decoder needs most memory for.
geometry::TriangleMesh loose(const geometry::TriangleMesh& mesh) {
  geometry::TriangleMesh all;
  for (const geometry::Triangle& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(all.positions_O.size());
    for (const std::uint32_t index : triangle) all.positions_O.push_back(mesh.positions_O[index]);
    all.triangles.push_back({first, first + 1, first + 2});
  }
  return all;
}

double ms_of(const codecs::DecodeMeshes& decode, std::span<const codecs::CodedMesh> coded) {
  const auto began = std::chrono::steady_clock::now();
  if (const auto meshes = decode(coded); !meshes) throw std::runtime_error(meshes.error());
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Of address space, to the next MB; by trying.
std::uint64_t least_memory_mb(const Options& options, std::span<const codecs::CodedMesh> coded) {
  std::uint64_t fails = 1, works = 4096;
  while (works - fails > std::max<std::uint64_t>(1, works / 50)) {
    const std::uint64_t tried = (fails + works) / 2;
    const auto decode = master_station::decode_meshes_apart(options.program, {tried * 1'000'000, 60, 0});
    (decode(coded) ? works : fails) = tried;
  }
  return works;
}

void run(const Options& options) {
  json rows = json::array();
  fmt::print("triangles  meshes  bytes      here ms  apart ms  least MB\n");
  struct Case {
    std::uint32_t side;
    std::size_t meshes;
    bool is_loose;
  };
  for (const Case& one : {Case{10, 2, false}, Case{100, 2, false}, Case{316, 2, false}, Case{500, 1, true},
                          Case{1000, 1, false}, Case{1000, 2, false}}) {
    const geometry::TriangleMesh mesh = one.is_loose ? loose(sheet(one.side)) : sheet(one.side);
    const auto bitstream = codecs::write_draco(mesh);
    if (!bitstream) throw std::runtime_error(bitstream.error());
    const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    const std::vector<codecs::CodedMesh> coded(one.meshes, {triangles, *bitstream});
    const codecs::DecodeMeshes decode_apart = master_station::decode_meshes_apart(options.program);
    std::vector<double> here, apart;
    for (int i = 0; i < options.repeats; ++i) {
      here.push_back(ms_of(codecs::decode_meshes, coded));
      apart.push_back(ms_of(decode_apart, coded));
    }
    const std::uint64_t least_mb = least_memory_mb(options, coded);
    fmt::print("{:9}  {:6}  {:9}  {:7.1f}  {:8.1f}  {:8}{}\n", triangles * one.meshes, one.meshes,
               bitstream->size() * one.meshes, median(here), median(apart), least_mb,
               one.is_loose ? "  loose triangles" : "");
    rows.push_back({{"triangles", triangles * one.meshes},
                    {"loose", one.is_loose},
                    {"meshes", one.meshes},
                    {"bytes", bitstream->size() * one.meshes},
                    {"here_ms", median(here)},
                    {"apart_ms", median(apart)},
                    {"least_memory_mb", least_mb}});
  }
  if (options.as_json) fmt::print("{}\n", json{{"scene_apart", {{"rows", rows}}}}.dump());
}

}  // namespace

void add_scene_apart(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("scene-apart", "A scene's meshes, decoded here and in a process apart");
  app->add_option("--program", options->program, "the farfeel-master that decodes")->capture_default_str();
  app->add_option("--repeats", options->repeats, "of each; medians are told")->check(CLI::Range(1, 1000));
  app->add_flag("--json", options->as_json, "one JSON object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
