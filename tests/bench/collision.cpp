// All pairs of near convex pieces: ours, Bullet in double precision and FCL.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/clustering.h"
#include "slave_sim/bake/asset_cache.h"
#include "tests/bench/bench.h"
#include "tests/bench/collision_cases.h"
#include "tests/bench/collision_run.h"
#include "tests/bench/collision_scaling.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr double kFailed = 1e-6;  // of a case's size: a larger error is a failure, as is no answer or no unit normal
constexpr std::size_t kLatticeCases = 3000;

struct Options {
  std::vector<std::string> scenes = {"file-cad", "block-gear", "hammer-torus", "torus-torus"};
  std::vector<std::uint64_t> seeds = {1, 2, 3};
  std::size_t frames = 2000;
  int replays = 5;
  bool as_json = false;
  std::string csv, svg;
};

struct Row {
  std::string scene, library, motion;
  std::uint64_t seed;
  Timing time;
};

geometry::HapticSurface surface_of(const std::string& model) {
  auto asset = slave_sim::cached_model_asset(model);
  if (!asset) throw CLI::RuntimeError(asset.error().message, 1);
  return std::move(asset->felt);
}

// Empty, with the reason, when a model of the scene does not exist yet.
std::optional<BenchScene> scene_named(const std::string& name, std::string& reason) {
  struct Definition {
    const char *name, *S, *T;
    double tolerance_m;
    spatial::Pose X_ST_rest;
    double tilt_rad;
    double region;  // half its size, in sizes of S, about S's centre
    std::optional<double> pairs;
  };
  const spatial::Pose as_is, on_its_rim{spatial::rotation_from_vector({M_PI / 2, 0, 0}), {}};
  const Definition definitions[] = {{"file-cad", "cad", "file", 0.005, as_is, 0.05, 0.08, 104.0},
                                    {"block-gear", "block", "gear", 0.005, on_its_rim, 0.06, 0.25, {}},
                                    {"hammer-torus", "torus", "hammer", 0.005, as_is, 0.2, 0.25, {}},
                                    {"torus-torus", "torus", "torus", 0.005, on_its_rim, 0.2, 0.25, {}}};
  for (const Definition& d : definitions) {
    if (name != d.name) continue;
    for (const char* model : {d.S, d.T}) {
      if (slave_sim::find_model(model) == nullptr) {
        reason = fmt::format("there is no model called {} yet", model);
        return {};
      }
    }
    BenchScene scene{name, surface_of(d.S), surface_of(d.T), d.tolerance_m, {}, d.pairs};
    const geometry::Box box_s = geometry::bounding_box(scene.S.coarse), box_t = geometry::bounding_box(scene.T.coarse);
    const double radius_t = 0.5 * glm::length(box_t.size());
    scene.plan.X_ST_rest = d.X_ST_rest;
    scene.plan.tilt_rad = d.tilt_rad, scene.plan.turn_rad = 0.6;
    scene.plan.region_low_m = box_s.centre() - d.region * box_s.size();
    scene.plan.region_high_m = box_s.centre() + d.region * box_s.size();
    scene.plan.region_high_m.z = box_s.high.z + radius_t;
    return scene;
  }
  reason = "no scene has that name";
  return {};
}

std::vector<spatial::Pose> motion_for(const BenchScene& scene, const collision::HullTree& S,
                                      const collision::HullTree& T, std::uint64_t seed, const Options& options) {
  if (!scene.pairs) return recorded_motion(S, T, scene.tolerance_m, scene.plan, seed, options.frames);
  return recorded_motion_with_pairs(S, T, scene.tolerance_m, scene.plan, seed, options.frames, *scene.pairs);
}

json as_json(const Timing& t) {
  return {{"p50_us", t.p50_us},
          {"p95_us", t.p95_us},
          {"p99_us", t.p99_us},
          {"max_us", t.max_us},
          {"pairs_mean", t.pairs_mean}};
}

// What the motion is like: for the reader, and to see that it is what the scene promises.
json character_of(const BenchScene& scene, const collision::HullTree& S, const collision::HullTree& T,
                  const std::vector<spatial::Pose>& motion) {
  collision::ProximityQuery query(S, T);
  contact::Clustering clustering;
  double touching = 0, contacts = 0, pairs = 0, fastest = 0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const auto near = query.nearer_than(scene.tolerance_m, motion[i]);
    const auto clusters = clustering.update(near, scene.tolerance_m, 1e-3);
    pairs += double(near.size());
    const bool is_touching =
        std::any_of(near.begin(), near.end(), [](const auto& p) { return p.distance_m < 0 && p.facing > 0; });
    touching += is_touching;
    if (is_touching) contacts += double(clusters.size());
    if (i > 0) fastest = std::max(fastest, glm::distance(motion[i].p, motion[i - 1].p) / 1e-3);
  }
  const auto n = double(motion.size());
  return {{"pairs_mean", pairs / n},
          {"contact_share", touching / n},
          {"contacts_mean_in_contact", touching > 0 ? contacts / touching : 0},
          {"fastest_m_per_s", fastest}};
}

// Slope and offset of time against pairs, by least squares.
json fitted_line(const std::vector<std::pair<double, double>>& points) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [x, y] : points) n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  const double slope = (n * sxy - sx * sy) / std::max(1e-300, n * sxx - sx * sx);
  return {{"us_per_pair", slope}, {"us_without_pairs", (sy - slope * sx) / n}};
}

json run_scene(const BenchScene& scene, const Options& options, std::vector<Row>& rows) {
  const collision::HullTree S{collision::ConvexPieces(scene.S)}, T{collision::ConvexPieces(scene.T)};
  json result = {{"pieces", {scene.S.piece_count, scene.T.piece_count}}};
  for (const CollisionLibrary& library : collision_libraries()) {
    const bool is_ours = library.name == "ours";
    Timing sum;
    Accuracy worst;
    json seeds = json::object();
    std::vector<std::pair<double, double>> points;
    for (const std::uint64_t seed : options.seeds) {
      const auto motion = motion_for(scene, S, T, seed, options);
      std::vector<spatial::Pose> fast;  // ten times the speed: every tenth pose, back and forth
      for (std::size_t i = 0; i < motion.size(); i += 10) fast.push_back(motion[i]);
      const auto peer = library.open(S, T, scene.tolerance_m);
      const auto run = [&](const char* name, const std::vector<spatial::Pose>& poses, bool is_cold, auto* out) {
        rows.push_back({scene.name, library.name, name, seed,
                        timing(*peer, scene.tolerance_m, poses, options.replays, is_cold, out)});
        return rows.back().time;
      };
      const Timing as_recorded = run("recorded", motion, false, &points);
      seeds[std::to_string(seed)] = as_json(as_recorded);
      seeds[std::to_string(seed)]["ten_times_faster"] = as_json(run("ten times faster", fast, false, &points));
      seeds[std::to_string(seed)]["cold"] = as_json(run("cold", fast, true, &points));
      if (is_ours) seeds[std::to_string(seed)]["motion"] = character_of(scene, S, T, motion);
      const double share = 1 / double(options.seeds.size());
      sum.p50_us += share * as_recorded.p50_us, sum.p95_us += share * as_recorded.p95_us;
      sum.p99_us += share * as_recorded.p99_us, sum.max_us = std::max(sum.max_us, as_recorded.max_us);
      sum.pairs_mean += share * as_recorded.pairs_mean;
      const Accuracy a = accuracy(scene, *peer, motion, std::max<std::size_t>(1, motion.size() / 20), !is_ours);
      worst.missed += a.missed, worst.extra += a.extra, worst.checked += a.checked;
      worst.max_error_rel = std::max(worst.max_error_rel, a.max_error_rel);
      std::fprintf(stderr,
                   "%-12s %-10s seed %llu: p50 %7.1f p95 %7.1f p99 %7.1f max %7.1f us, %.1f pairs, missed %zu extra "
                   "%zu, error %.1e\n",
                   scene.name.c_str(), library.name.c_str(), static_cast<unsigned long long>(seed), as_recorded.p50_us,
                   as_recorded.p95_us, as_recorded.p99_us, as_recorded.max_us, as_recorded.pairs_mean, a.missed,
                   a.extra, a.max_error_rel);
    }
    json& entry = result[library.name] = as_json(sum);
    entry["missed"] = worst.missed, entry["extra"] = worst.extra, entry["checked"] = worst.checked;
    entry["max_error_rel"] = worst.max_error_rel;
    entry["seeds"] = seeds;
    entry["time_with_pairs"] = fitted_line(points);
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
  json failed = json::object(), worst = json::object();
  for (const CollisionLibrary& library : collision_libraries()) {
    const std::vector<PeerAnswer> given = answers(library, cases);
    int failures = 0;
    double error = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const CollisionCase& c = cases[i];
      const double size = std::max(c.size_m, std::abs(c.distance_m));
      const double off = std::abs(given[i].distance_m - c.distance_m) / (size > 0 ? size : 1);
      const bool is_right = off <= kFailed && std::abs(glm::length(given[i].direction) - 1) < 1e-6;
      failures += !is_right;
      if (is_right) error = std::max(error, off);
    }
    failed[library.name] = failures, worst[library.name] = error;
  }
  return {{"cases", cases.size()}, {"failed", failed}, {"worst_error_of_the_others", worst}};
}

void write_csv(const std::string& path, const std::vector<Row>& rows) {
  std::ofstream file(path);
  file << "scene,library,motion,seed,p50_us,p95_us,p99_us,max_us,pairs_mean\n";
  for (const Row& r : rows) {
    file << fmt::format("{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.2f}\n", r.scene, r.library, r.motion, r.seed,
                        r.time.p50_us, r.time.p95_us, r.time.p99_us, r.time.max_us, r.time.pairs_mean);
  }
}

// Horizontal bars from p50 to p99 on a logarithmic axis of microseconds.
void write_svg(const std::string& path, const std::vector<Row>& rows) {
  const double left = 330, decade = 130, line = 16;
  const auto x = [&](double us) { return left + decade * std::log10(std::max(us, 1.0)); };
  std::ofstream file(path);
  file << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" "
      "font-size=\"11\">\n",
      left + 4.5 * decade, line * (double(rows.size()) + 3));
  for (int k = 0; k <= 4; ++k) {
    file << fmt::format(
        "<line x1=\"{0}\" x2=\"{0}\" y1=\"20\" y2=\"{1}\" stroke=\"#ccc\"/><text x=\"{0}\" y=\"14\">{2:.0f} "
        "us</text>\n",
        x(std::pow(10, k)), line * (double(rows.size()) + 2), std::pow(10, k));
  }
  double y = 2 * line;
  for (const Row& r : rows) {
    const char* colour = r.library == "ours" ? "#1b7837" : r.library == "fcl" ? "#762a83" : "#b35806";
    file << fmt::format(
        "<text x=\"4\" y=\"{}\">{} {} ({}, seed {})</text><line x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\" "
        "stroke=\"{}\" stroke-width=\"7\"/>\n",
        y, r.scene, r.library, r.motion, r.seed, x(r.time.p50_us), x(r.time.p99_us) + 1, y - 4, y - 4, colour);
    y += line;
  }
  file << "</svg>\n";
}

void run(const Options& options) {
  json result = {{"scenes", json::object()}, {"skipped", json::object()}};
  for (const std::string& missing : missing_collision_libraries()) result["skipped"]["libraries"].push_back(missing);
  std::vector<Row> rows;
  for (const std::string& name : options.scenes) {
    std::string reason;
    if (const auto scene = scene_named(name, reason)) {
      result["scenes"][name] = run_scene(*scene, options, rows);
    } else {
      result["skipped"][name] = reason;
      std::fprintf(stderr, "%s: skipped: %s\n", name.c_str(), reason.c_str());
    }
  }
  result["degenerate"] = run_cases(degenerate_cases());
  result["lattice"] = run_cases(lattice_cases(kLatticeCases));
  for (const CollisionLibrary& library : collision_libraries()) {
    const CollisionScaling s = collision_scaling(library);
    result["exponents"][library.name] = {{"hull_vertices", s.with_hull_vertices}, {"pieces", s.with_pieces}};
  }
  for (const char* suite : {"degenerate", "lattice"}) {
    std::fprintf(stderr, "%s: %s\n", suite, result[suite].dump().c_str());
  }
  std::fprintf(stderr, "exponents: %s\n", result["exponents"].dump().c_str());
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
  command->add_option("--csv", options->csv, "also write every timing there");
  command->add_option("--svg", options->svg, "also draw them there");
  command->add_flag("--json", options->as_json, "print one JSON object as the last line");
  command->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
