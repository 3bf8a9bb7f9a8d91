// farfeel-bench bake: how well, how small and how fast meshes become assets, and what becomes of bad ones. Every row is
// baked in a process of its own, so that its peak memory is its own too.
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

#include "slave_sim/bake/bake_within.h"
#include "slave_sim/bake/repair.h"
#include "slave_sim/models/models.h"
#include "tests/bench/bench.h"
#include "tests/bench/felt_bytes.h"
#include "tests/bench/plain_draco.h"
#include "tests/bench/touch_models.h"
#include "tests/support/bad_meshes.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

struct Options {
  std::vector<std::string> models;  ///< and scans and bad meshes, by their names; empty for all
  std::string scans = "../shared/models";
  bool is_full = false, as_json = false;
};

struct Subject {
  std::string name;
  TouchModel whole;  ///< a benchmark model or a scan, or else
  const support::BadMesh* bad = nullptr;
  [[nodiscard]] bool is_model() const { return !whole.benchmark.empty(); }
  [[nodiscard]] bool is_baked() const { return bad == nullptr || bad->is_baked; }
};

/// What is asked of a bake: an error, or a number of triangles with this texture.
struct Ask {
  double rms_m = 0;  ///< 0: the triangles that a bake takes unasked
  std::uint32_t texture = 1024;
};

tl::expected<TouchMesh, std::string> mesh_of(const Subject& subject) {
  if (subject.bad == nullptr) return touch_mesh(subject.whole);
  auto repaired = slave_sim::repaired(subject.bad->make());
  if (!repaired) return tl::unexpected(repaired.error().message);
  TouchMesh out{std::move(repaired->mesh), {}};
  out.options.left_out = std::move(repaired->left_out);
  return out;
}

tl::expected<slave_sim::Baked, slave_sim::BakeError> baked_as_asked(const std::string& name, const TouchMesh& given,
                                                                    const Ask& ask) {
  slave_sim::BakeOptions options = given.options;
  options.texture = ask.texture;
  if (!(ask.rms_m > 0)) return slave_sim::bake_asset(name, given.mesh, options);
  options.coarse.reset();  // as anybody's mesh
  return slave_sim::bake_within(name, given.mesh, std::move(options), ask.rms_m).map([](slave_sim::BakedWithin within) {
    return std::move(within.baked);
  });
}

void add_figures(json& row, const Subject& subject, const TouchMesh& given, const Ask& ask) {
  const auto started = std::chrono::steady_clock::now();
  const auto baked = baked_as_asked(subject.name, given, ask);
  if (!baked) {
    row["error"] = baked.error().message;
    return;
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - started;
  const auto bytes = codecs::write_asset(baked->asset);
  if (!bytes) {
    row["error"] = bytes.error().message;
    return;
  }
  const slave_sim::BakeReport& r = baked->report;
  const double rms_m = std::max(r.full_to_felt.rms_m, r.felt_to_full.rms_m);
  const slave_sim::Model* model = subject.is_model() ? slave_sim::find_model(subject.whole.benchmark) : nullptr;
  const FeltParts parts = felt_parts(baked->asset);
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  row.update(json{{"full_triangles", r.full_triangles},
                  {"coarse_triangles", r.coarse_triangles},
                  {"pieces", r.pieces},
                  {"source_pieces", model != nullptr ? json(model->source_pieces) : json(nullptr)},
                  {"texture", r.texture},
                  {"rms_um", 1e6 * rms_m},
                  {"max_um", 1e6 * std::max(r.full_to_felt.max_m, r.felt_to_full.max_m)},
                  {"p99_um", 1e6 * std::max(r.full_to_felt.p99_m, r.felt_to_full.p99_m)},
                  {"near_pairs_p95", r.near_pairs_p95},
                  {"thickness_um", 1e6 * r.thickness_m},
                  {"full_to_felt_rms_um", 1e6 * r.full_to_felt.rms_m},
                  {"felt_to_full_rms_um", 1e6 * r.felt_to_full.rms_m},
                  {"size_m", glm::length(geometry::bounding_box(given.mesh).size())},
                  {"missed_share",
                   static_cast<double>(r.missed_texels) / static_cast<double>(std::max<std::uint64_t>(1, r.texels))},
                  {"lost_spectrum_share", r.lost_share},
                  {"keeping_texture", r.keeping_texture},
                  {"slope_rms", r.felt_slope.rms},
                  {"seam_rms_um", 1e6 * r.seam_step.rms_m},
                  {"seam_slope_rms", r.seam_slope.rms},
                  {"seconds", seconds.count()},
                  {"peak_MB", static_cast<double>(used.ru_maxrss) / 1024},
                  {"asset_bytes", bytes->size()},
                  {"felt_bytes", felt_bytes(*bytes)},
                  {"felt_coarse_bytes", parts.coarse},
                  {"felt_pieces_bytes", parts.pieces},
                  {"felt_heights_bytes", parts.heights}});
  for (const auto& stage : r.stages) row["stage_s"][stage.stage] = stage.seconds;
  const PlainDraco plain = plain_draco(given.mesh, rms_m);
  row["plain_bytes"] = plain.bytes > 0 ? json(plain.bytes) : json(nullptr);
  row["plain_triangles"] = plain.triangles;
}

/// With "error": why it cannot be baked; or "skipped": why it is not tried.
json row_of(const Subject& subject, const Ask& ask) {
  json row = {{"model", subject.name},
              {"asked_um", ask.rms_m > 0 ? json(1e6 * ask.rms_m) : json(nullptr)},
              {"expected", subject.is_baked() ? "baked" : "refused"}};
  std::error_code ignored;
  if (!subject.whole.scan.empty() && !std::filesystem::exists(subject.whole.scan, ignored)) {
    row["skipped"] = fmt::format("there is no file {}; --scans names its folder", subject.whole.scan.string());
    return row;
  }
  if (const auto given = mesh_of(subject)) {
    add_figures(row, subject, *given, ask);
  } else {
    row["error"] = given.error();
  }
  return row;
}

json row_in_its_own_process(const Subject& subject, const Ask& ask) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) return {{"model", subject.name}, {"error", "no pipe"}};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    const std::string text = row_of(subject, ask).dump();
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
  int status = 0;
  waitpid(child, &status, 0);
  json row = json::parse(text, nullptr, false);
  if (!row.is_object()) row = {{"model", subject.name}, {"expected", "baked"}, {"error", "the bake did not end well"}};
  return row;
}

std::vector<Subject> chosen_subjects(const Options& options) {
  std::vector<Subject> all;
  for (const slave_sim::Model& model : slave_sim::models())
    all.push_back({.name = std::string(model.name), .whole = {.name = {}, .benchmark = std::string(model.name)}});
  for (const TouchModel& model : touch_models(options.scans)) {
    if (!model.scan.empty()) all.push_back({.name = model.name, .whole = model});
  }
  for (const support::BadMesh& bad : support::bad_meshes()) {
    if (options.is_full || !bad.is_huge) all.push_back({.name = std::string(bad.name), .whole = {}, .bad = &bad});
  }
  if (options.models.empty()) return all;
  std::vector<Subject> chosen;
  for (const std::string& name : options.models) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Subject& s) { return s.name == name; });
    if (found == all.end()) throw CLI::ValidationError("--models", "there is no model, scan or bad mesh " + name);
    chosen.push_back(*found);
  }
  return chosen;
}

std::vector<Ask> asked_of(const Subject& subject, bool is_full) {
  std::vector<Ask> asked;
  if (subject.bad != nullptr && !is_full) return {{.rms_m = 200e-6}};
  if (is_full) {
    for (const std::uint32_t texture : {256U, 512U, 1024U, 2048U, 4096U}) asked.push_back({.texture = texture});
    for (const double rms_m : {20e-6, 50e-6, 100e-6, 200e-6, 500e-6}) asked.push_back({.rms_m = rms_m});
    return asked;
  }
  return {{}, {.rms_m = 50e-6}, {.rms_m = 200e-6}};
}

void print(const json& row) {
  const std::string name = row["model"], asked = row["asked_um"].is_null() ? "-" : row["asked_um"].dump();
  if (row.contains("skipped")) {
    fmt::print("{:<21}{:>7} skipped: {}\n", name, asked, row["skipped"].get<std::string>());
  } else if (row.contains("error")) {
    fmt::print("{:<21}{:>7} {}: {}\n", name, asked, row["expected"] == "refused" ? "refused, as expected" : "REFUSED",
               row["error"].get<std::string>());
  } else {
    const auto kB = [&](const char* key) {
      return row[key].is_null() ? std::string("-") : fmt::format("{:.0f}", row[key].get<double>() / 1e3);
    };
    fmt::print("{:<21}{:>7}{:>9}{:>8}{:>7}{:>8}{:>8}{:>7.1f}{:>7.0f}{:>8.0f}{:>7}{:>8.1f}{:>7.0f}{:>8}{:>8}{:>8}\n",
               name, asked, row["full_triangles"].get<int>(), row["coarse_triangles"].get<int>(),
               row["pieces"].get<int>(), row["source_pieces"].is_null() ? "-" : row["source_pieces"].dump(),
               row["texture"].get<int>(), row["rms_um"].get<double>(), row["p99_um"].get<double>(),
               row["max_um"].get<double>(), row["near_pairs_p95"].get<int>(), row["seconds"].get<double>(),
               row["peak_MB"].get<double>(), kB("asset_bytes"), kB("felt_bytes"), kB("plain_bytes"));
    if (row["expected"] == "refused") fmt::print("{:<21}BAKED, though it should be refused\n", "");
  }
  std::fflush(stdout);
}

void run(const Options& options) {
  fmt::print(
      "rms um: the larger of from the full mesh to what is felt, and back; theirs: the source's convex pieces; felt "
      "and plain kB:\nwhat is felt of the asset, and the mesh by Draco alone at the same rms\n");
  fmt::print("{:<21}{:>7}{:>9}{:>8}{:>7}{:>8}{:>8}{:>7}{:>7}{:>8}{:>7}{:>8}{:>7}{:>8}{:>8}{:>8}\n", "model", "asked",
             "full", "coarse", "pieces", "theirs", "texture", "rms", "p99", "max um", "pairs", "s", "MB", "kB",
             "felt kB", "plain");
  json rows = json::array();
  bool is_as_expected = true;
  for (const Subject& subject : chosen_subjects(options)) {
    for (const Ask& ask : asked_of(subject, options.is_full)) {
      rows.push_back(row_in_its_own_process(subject, ask));
      print(rows.back());
      const bool is_baked = !rows.back().contains("error");
      if (!rows.back().contains("skipped") && is_baked != subject.is_baked()) is_as_expected = false;
    }
  }
  if (options.as_json) fmt::print("{}\n", json{{"rows", rows}}.dump());
  if (!is_as_expected) throw CLI::RuntimeError(1);
}

}  // namespace

void add_bake(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* bake = bench.add_subcommand(
      "bake", "Displacement error both ways, time, memory and size of baked meshes, and what becomes of bad ones");
  bake->add_option("--models", options->models,
                   "benchmark models, scans and bad meshes, by name; without it all of them");
  bake->add_option("--scans", options->scans, "a folder of .obj scans")->capture_default_str();
  bake->add_flag("--full", options->is_full,
                 "curves: textures from 256 to 4096, errors from 20 to 500 um, and large meshes");
  bake->add_flag("--json", options->as_json, "one JSON object as the last line");
  bake->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
