// All pairs of near convex pieces: ours, Bullet in double precision and FCL.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/collision_cases.h"
#include "tests/bench/collision_report.h"
#include "tests/bench/collision_run.h"
#include "tests/bench/collision_scaling.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr double kFailed = 1e-6;  // of a case's size: a larger error is a failure, as is no answer or no unit normal
constexpr std::size_t kLatticeCases = 3000;
constexpr std::size_t kOracleFrames = 20;  // of each seed's motion

struct Options {
  std::vector<std::string> scenes{benchmark_scene_names().begin(), benchmark_scene_names().end()};
  std::vector<std::uint64_t> seeds = {1, 2, 3};
  std::size_t frames = 2000;
  int replays = 5;
  bool is_quick = false, as_json = false;
  std::string csv, svg;
};

json as_json(const Timing& t) {
  return {{"p50_us", t.p50_us},
          {"p95_us", t.p95_us},
          {"p99_us", t.p99_us},
          {"max_us", t.max_us},
          {"pairs_mean", t.pairs_mean}};
}

json as_json(const MotionCharacter& c) {
  return {{"pairs_mean", c.pairs_mean},           {"pairs_deviation", c.pairs_deviation},
          {"contact_share", c.contact_share},     {"contacts_mean_in_contact", c.contacts_mean},
          {"fastest_m_per_s", c.fastest_m_per_s}, {"median_m_per_s", c.median_m_per_s}};
}

// Slope and offset of time against pairs, by least squares.
json fitted_line(const std::vector<std::pair<double, double>>& points) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [x, y] : points) n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  const double slope = (n * sxy - sx * sy) / std::max(1e-300, n * sxx - sx * sx);
  return {{"us_per_pair", slope}, {"us_without_pairs", (sy - slope * sx) / n}};
}

// All seeds of one scene: for each library the mean of the seeds' quantiles and the worst of the rest. Fills in the
// details: every motion of every seed by itself.
json run_scene(const BenchmarkScene& scene, const Options& options, std::vector<TimingRow>& rows, json& details) {
  const collision::HullTree S{collision::ConvexPieces(scene.object.felt)}, T{collision::ConvexPieces(scene.tool.felt)};
  details["pieces"] = {scene.object.felt.piece_count, scene.tool.felt.piece_count};
  std::vector<Entrant> entrants;
  for (const CollisionLibrary& library : collision_libraries()) {
    entrants.push_back({library.name, library.name != "ours", library.open(S, T, scene.tolerance_m)});
  }
  std::vector<Timing> sums(entrants.size());
  std::vector<Accuracy> worst(entrants.size());
  std::vector<std::vector<std::pair<double, double>>> points(entrants.size());
  const double share = 1 / double(options.seeds.size());
  for (const std::uint64_t seed : options.seeds) {
    const auto motion = scene.motion(seed, options.frames);
    std::vector<spatial::Pose> fast;  // ten times the speed: every tenth pose
    for (std::size_t i = 0; i < motion.size(); i += 10) fast.push_back(motion[i]);
    json& of_seed = details["seeds"][std::to_string(seed)];
    of_seed["motion"] = as_json(character_of(S, T, scene.tolerance_m, motion));
    const auto run = [&](const char* name, const std::vector<spatial::Pose>& poses, bool is_cold) {
      const auto results = timings(entrants, scene.tolerance_m, poses, options.replays, is_cold);
      for (std::size_t k = 0; k < entrants.size(); ++k) {
        rows.push_back({scene.name, entrants[k].name, name, seed, results[k]});
        of_seed[name][entrants[k].name] = as_json(results[k]);
        points[k].insert(points[k].end(), results[k].pairs_and_us.begin(), results[k].pairs_and_us.end());
      }
      return results;
    };
    const auto recorded = run("recorded", motion, false);
    run("ten_times_faster", fast, false);
    run("cold", fast, true);
    const auto right = accuracies(scene, entrants, motion, std::max<std::size_t>(1, motion.size() / kOracleFrames));
    for (std::size_t k = 0; k < entrants.size(); ++k) {
      const Timing& t = recorded[k];
      const Accuracy& a = right[k];
      sums[k].p50_us += share * t.p50_us, sums[k].p95_us += share * t.p95_us, sums[k].p99_us += share * t.p99_us;
      sums[k].max_us = std::max(sums[k].max_us, t.max_us), sums[k].pairs_mean += share * t.pairs_mean;
      worst[k].missed += a.missed, worst[k].extra += a.extra;
      worst[k].max_error_rel = std::max(worst[k].max_error_rel, a.max_error_rel);
      of_seed["checked"][entrants[k].name] = a.checked;
      std::fprintf(stderr,
                   "%-12s %-10s seed %llu: p50 %7.1f p95 %7.1f p99 %7.1f max %7.1f us, %.1f pairs, missed %zu extra "
                   "%zu, error %.1e\n",
                   scene.name.c_str(), entrants[k].name.c_str(), static_cast<unsigned long long>(seed), t.p50_us,
                   t.p95_us, t.p99_us, t.max_us, t.pairs_mean, a.missed, a.extra, a.max_error_rel);
    }
  }
  json result = json::object();
  double fastest_peer_us = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < entrants.size(); ++k) {
    json& entry = result[entrants[k].name] = as_json(sums[k]);
    entry["missed"] = worst[k].missed, entry["extra"] = worst[k].extra;
    entry["max_error_rel"] = worst[k].max_error_rel;
    details["time_with_pairs"][entrants[k].name] = fitted_line(points[k]);
    if (entrants[k].is_plain) fastest_peer_us = std::min(fastest_peer_us, sums[k].p50_us);
  }
  if (entrants.size() > 1) {
    details["times_faster_than_the_faster_peer"] = fastest_peer_us / sums[0].p50_us;
    std::fprintf(stderr, "%-12s %.1f times faster at p50 than the faster peer\n", scene.name.c_str(),
                 fastest_peer_us / sums[0].p50_us);
  }
  return result;
}

// One library's answers. Asked in a child process, because a peer may abort: that case then has no answer, and another
// child takes the next.
std::vector<PeerAnswer> answers(const CollisionLibrary& library, const std::vector<CollisionCase>& cases) {
  const PeerAnswer none{std::numeric_limits<double>::quiet_NaN(), glm::dvec3(0)};
  std::vector<PeerAnswer> all;
  while (all.size() < cases.size()) {
    int ends[2];
    if (pipe(ends) != 0) throw CLI::RuntimeError("no pipe for the peers' answers", 1);
    const pid_t child = fork();
    if (child == 0) {
      if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
      for (std::size_t i = all.size(); i < cases.size(); ++i) {
        const PeerAnswer answer = library.measure(cases[i].A, cases[i].B);
        if (write(ends[1], &answer, sizeof answer) != sizeof answer) _exit(1);
      }
      _exit(0);
    }
    close(ends[1]);
    PeerAnswer answer{};
    while (all.size() < cases.size() && read(ends[0], &answer, sizeof answer) == sizeof answer) all.push_back(answer);
    close(ends[0]);
    if (child < 0 || waitpid(child, nullptr, 0) != child)
      throw CLI::RuntimeError("no process for the peers' answers", 1);
    if (all.size() < cases.size()) all.push_back(none);
  }
  return all;
}

json run_cases(const std::vector<CollisionCase>& cases) {
  json failed = json::object();
  for (const CollisionLibrary& library : collision_libraries()) {
    const std::vector<PeerAnswer> given = answers(library, cases);
    int failures = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const CollisionCase& c = cases[i];
      const double size = std::max(c.size_m, std::abs(c.distance_m));
      const double off = std::abs(given[i].distance_m - c.distance_m) / (size > 0 ? size : 1);
      const bool is_right = off <= kFailed && std::abs(glm::length(given[i].direction) - 1) < 1e-6;
      failures += !is_right;
    }
    failed[library.name] = failures;
  }
  return {{"cases", cases.size()}, {"failed", failed}};
}

void run(Options options) {
  if (options.is_quick) options.frames = 400, options.replays = 3, options.seeds.resize(1);
  json result = {{"scenes", json::object()}};
  json& details = result["details"];
  for (const std::string& missing : missing_collision_libraries()) details["skipped"]["libraries"].push_back(missing);
  std::vector<TimingRow> rows;
  for (const std::string& name : options.scenes) {
    result["scenes"][name] = run_scene(benchmark_scene(name), options, rows, details[name]);
  }
  result["degenerate"] = run_cases(degenerate_cases());
  result["lattice"] = run_cases(lattice_cases(kLatticeCases));
  for (const char* suite : {"degenerate", "lattice"}) {
    std::fprintf(stderr, "%s: %s\n", suite, result[suite].dump().c_str());
  }
  for (const CollisionLibrary& library : collision_libraries()) {
    const CollisionScaling s = collision_scaling(library);
    details["growth_exponents"][library.name] = {{"hull_vertices", s.with_hull_vertices}, {"pieces", s.with_pieces}};
  }
  std::fprintf(stderr, "growth exponents: %s\n", details["growth_exponents"].dump().c_str());
  if (!options.csv.empty()) write_csv(options.csv, rows);
  if (!options.svg.empty()) write_svg(options.svg, rows);
  if (options.as_json) std::printf("%s\n", result.dump().c_str());
}

}  // namespace

std::vector<CollisionLibrary> collision_libraries() {
  std::vector<CollisionLibrary> all = {farfeel_library()};
#ifdef FARFEEL_BENCH_BULLET
  all.push_back(bullet_library());
#endif
#ifdef FARFEEL_BENCH_FCL
  all.push_back(fcl_library());
#endif
  return all;
}

std::vector<std::string> missing_collision_libraries() {
  std::vector<std::string> missing;
#ifndef FARFEEL_BENCH_BULLET
  missing.emplace_back("bullet_f64: built without libbullet-dev");
#endif
#ifndef FARFEEL_BENCH_FCL
  missing.emplace_back("fcl: built without libfcl-dev");
#endif
  return missing;
}

void add_collision(CLI::App& app) {
  CLI::App* command = app.add_subcommand("collision", "all pairs of near convex pieces: ours, Bullet and FCL");
  const auto options = std::make_shared<Options>();
  command->add_option("--scenes", options->scenes, "which scenes")->capture_default_str();
  command->add_option("--seeds", options->seeds, "of the recorded motions")->capture_default_str();
  command->add_option("--frames", options->frames, "poses of a motion, at 1 kHz")
      ->capture_default_str()
      ->check(CLI::Range(20, 1'000'000));
  command->add_option("--replays", options->replays, "passes, of which a frame's least time counts")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command->add_flag("--quick", options->is_quick, "one seed, 400 frames, 3 passes: half a minute");
  command->add_option("--csv", options->csv, "also write every timing there");
  command->add_option("--svg", options->svg, "also draw them there");
  command->add_flag("--json", options->as_json, "print one JSON object as the last line");
  command->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
