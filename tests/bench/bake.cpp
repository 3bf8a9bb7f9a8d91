// farfeel-bench bake: how well and how fast meshes become assets. Every row is baked in a process of its own, so that
// its peak memory is its own too.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "codecs/mesh/mesh_file.h"
#include "slave_sim/bake/asset_cache.h"
#include "slave_sim/bake/repair.h"
#include "tests/bench/bench.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

struct Options {
  std::vector<std::string> models;  ///< and scans, by their files' names; empty for all
  std::vector<std::uint32_t> textures{256, 512, 1024, 2048, 4096};
  std::string scans = "../shared/models";
  bool as_json = false;
};

struct Subject {
  std::string name;
  const slave_sim::Model* model = nullptr;  ///< or else
  std::filesystem::path file;
};

/// The row, without its peak memory; {"error": why} if it cannot be baked.
json baked_row(const Subject& subject, std::uint32_t texture) {
  geometry::TriangleMesh mesh;
  slave_sim::BakeOptions options;
  if (subject.model != nullptr) {
    mesh = subject.model->full_mesh();
    options = slave_sim::model_bake_options(*subject.model);
  } else {
    const auto read = codecs::read_mesh_file(subject.file);
    if (!read) return {{"error", read.error().message}};
    auto repaired = slave_sim::repaired(*read);
    if (!repaired) return {{"error", repaired.error().message}};
    mesh = std::move(repaired->mesh);
    options.left_out = std::move(repaired->left_out);
  }
  options.texture = texture;
  const auto started = std::chrono::steady_clock::now();
  const auto baked = slave_sim::bake_asset(subject.name, mesh, options);
  if (!baked) return {{"error", baked.error().message}};
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - started;
  const auto bytes = codecs::write_asset(baked->asset);
  const slave_sim::BakeReport& r = baked->report;
  json row = {{"model", subject.name},
              {"full_triangles", r.full_triangles},
              {"coarse_triangles", r.coarse_triangles},
              {"pieces", r.pieces},
              {"source_pieces", subject.model != nullptr ? json(subject.model->source_pieces) : json(nullptr)},
              {"texture", texture},
              {"rms_um", 1e6 * std::max(r.full_to_felt.rms_m, r.felt_to_full.rms_m)},
              {"max_um", 1e6 * std::max(r.full_to_felt.max_m, r.felt_to_full.max_m)},
              {"p99_um", 1e6 * std::max(r.full_to_felt.p99_m, r.felt_to_full.p99_m)},
              {"near_pairs_p95", r.near_pairs_p95},
              {"thickness_um", 1e6 * r.thickness_m},
              {"full_to_felt_rms_um", 1e6 * r.full_to_felt.rms_m},
              {"felt_to_full_rms_um", 1e6 * r.felt_to_full.rms_m},
              {"size_m", glm::length(geometry::bounding_box(mesh).size())},
              {"missed_share",
               static_cast<double>(r.missed_texels) / static_cast<double>(std::max<std::uint64_t>(1, r.texels))},
              {"lost_spectrum_share", r.lost_share},
              {"keeping_texture", r.keeping_texture},
              {"slope_rms", r.felt_slope.rms},
              {"seam_rms_um", 1e6 * r.seam_step.rms_m},
              {"seam_slope_rms", r.seam_slope.rms},
              {"seconds", seconds.count()},
              {"asset_bytes", bytes ? bytes->size() : 0}};
  for (const auto& stage : r.stages) row["stage_s"][stage.stage] = stage.seconds;
  return row;
}

json row_in_its_own_process(const Subject& subject, std::uint32_t texture) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return {{"error", "no pipe"}};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    const std::string text = baked_row(subject, texture).dump();
    const bool is_sent = write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
    _exit(is_sent ? 0 : 1);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t n = read(ends[0], buffer.data(), buffer.size()); n > 0;
       n = read(ends[0], buffer.data(), buffer.size())) {
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  close(ends[0]);
  rusage used{};
  int status = 0;
  wait4(child, &status, 0, &used);
  json row = json::parse(text, nullptr, false);
  if (!row.is_object()) row = {{"error", "the bake did not end well"}};
  row["peak_MB"] = static_cast<double>(used.ru_maxrss) / 1024;
  return row;
}

std::vector<Subject> chosen_subjects(const Options& options) {
  std::vector<Subject> all;
  for (const slave_sim::Model& model : slave_sim::models()) all.push_back({std::string(model.name), &model, {}});
  if (std::filesystem::is_directory(options.scans)) {
    for (const auto& entry : std::filesystem::directory_iterator(options.scans)) {
      if (entry.path().extension() == ".obj") all.push_back({entry.path().stem().string(), nullptr, entry.path()});
    }
  } else {
    fmt::print("skipped: scans, because there is no folder {}\n", options.scans);
  }
  std::sort(all.begin() + static_cast<std::ptrdiff_t>(slave_sim::models().size()), all.end(),
            [](const Subject& a, const Subject& b) { return a.name < b.name; });
  if (options.models.empty()) return all;
  std::vector<Subject> chosen;
  for (const std::string& name : options.models) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Subject& s) { return s.name == name; });
    if (found == all.end()) throw CLI::ValidationError("--models", "there is no model or scan " + name);
    chosen.push_back(*found);
  }
  return chosen;
}

void run(const Options& options) {
  const std::vector<Subject> subjects = chosen_subjects(options);
  fmt::print("rms um: from the full mesh to what is felt, and back; theirs: the source's convex pieces\n");
  fmt::print("{:<16}{:>9}{:>8}{:>8}{:>8}{:>9}{:>9}{:>8}{:>9}{:>9}{:>8}{:>9}{:>7}\n", "model", "full", "coarse",
             "pieces", "theirs", "texture", "to felt", "back", "max um", "missed", "s", "peak MB", "MB");
  json rows = json::array();
  for (const Subject& subject : subjects) {
    for (const std::uint32_t texture : options.textures) {
      json row = row_in_its_own_process(subject, texture);
      if (row.contains("error")) {
        fmt::print("{:<16}not baked: {}\n", subject.name, row["error"].get<std::string>());
        continue;
      }
      fmt::print("{:<16}{:>9}{:>8}{:>8}{:>8}{:>9}{:>9.1f}{:>8.1f}{:>9.0f}{:>9.4f}{:>8.1f}{:>9.0f}{:>7.2f}\n",
                 subject.name, row["full_triangles"].get<int>(), row["coarse_triangles"].get<int>(),
                 row["pieces"].get<int>(), subject.model != nullptr ? row["source_pieces"].dump() : "-", texture,
                 row["full_to_felt_rms_um"].get<double>(), row["felt_to_full_rms_um"].get<double>(),
                 row["max_um"].get<double>(), row["missed_share"].get<double>(), row["seconds"].get<double>(),
                 row["peak_MB"].get<double>(), row["asset_bytes"].get<double>() / 1e6);
      rows.push_back(std::move(row));
    }
  }
  if (options.as_json) fmt::print("{}\n", json{{"rows", rows}}.dump());
}

}  // namespace

void add_bake(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* bake = bench.add_subcommand("bake", "Displacement error both ways, time, memory and size of baked meshes");
  bake->add_option("--models", options->models, "benchmark models and scans, by name; without it all of them");
  bake->add_option("--textures", options->textures, "sides of the texture")->capture_default_str();
  bake->add_option("--scans", options->scans, "a folder of .obj scans")->capture_default_str();
  bake->add_flag("--json", options->as_json, "one JSON object as the last line");
  bake->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
