// Penetration depth alone: what each method costs and how far it is from truth, on pairs of plates whose shape is known
// in closed form; how much its force jumps along a slow slide; and what full-resolution meshes would say.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "haptic_core/penetration/reference/eleven_evaluations.h"
#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/bench/bench.h"
#include "tests/bench/named_back_end.h"
#include "tests/bench/peer_full_mesh.h"
#include "tests/bench/penetration_pairs.h"
#include "tests/bench/penetration_plot.h"
#include "tests/bench/penetration_slid.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using nlohmann::json;
using penetration::BackEnd;
using penetration::InstructionSet;
using penetration::Penetration;
using penetration::Query;

constexpr double kStiffness_N_per_m = 2000;  // of the jumps
constexpr double kLeastArm_m = 1e-3;         // torques are relative to the force at no shorter arm
constexpr double kSlideStep_m = 10e-6;       // 10 mm/s at 1 kHz
constexpr penetration::Limits kLimits{.coarse_triangles = 16};

struct Options {
  std::vector<std::string> scenes = {"ridged", "rough", "scan"};
  std::vector<unsigned> seeds = {1, 2, 3};
  std::vector<std::uint32_t> samples = {25, 50, 100, 200};
  std::size_t poses = 4, slide = 200, slow_slide = 20, frames = 2000;
  SlidOptions slid;
  bool only_slid = false;
  std::vector<std::string> back_ends;  // beside simd and the reference: egl, historical
  std::string svg, csv;
  bool as_json = false;
};

/// A way to get a depth and its gradient.
struct Method {
  std::string name, back_end_name;
  BackEnd* back_end;
  double soft_width_m;
  bool refines = true, by_differences = false, is_slow = false;
  std::vector<std::uint32_t> samples;
  const NamedBackEnd* named = nullptr;

  [[nodiscard]] Penetration answer(const PlatePair& pair, const spatial::Pose& X_CT, std::uint32_t n) const {
    Query query = pair.query(X_CT, soft_width_m, n);
    query.refines = refines;
    if (by_differences) return eleven_evaluations(*back_end, query, {});
    Penetration answer;
    back_end->evaluate({&query, 1}, {&answer, 1});
    return answer;
  }
};

double us_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

glm::dvec3 force_N(const Penetration& p) {
  return -kStiffness_N_per_m * std::max(p.depth_m, 0.0) * glm::dvec3{p.gradient[3], p.gradient[4], p.gradient[5]};
}
glm::dvec3 torque_Nm(const Penetration& p) {
  return -kStiffness_N_per_m * std::max(p.depth_m, 0.0) * glm::dvec3{p.gradient[0], p.gradient[1], p.gradient[2]};
}

/// Random poses pressed to between 0.05 and 0.3 mm of hard overlap.
std::vector<spatial::Pose> poses_of(const PlatePair& pair, BackEnd& back_end, const Options& options) {
  std::vector<spatial::Pose> poses;
  for (const unsigned seed : options.seeds) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (std::size_t i = 0; i < options.poses; ++i) {
      const double turn = 3 * unit(random);
      const glm::dvec2 tilt{4e-3 * unit(random), 4e-3 * unit(random)};
      glm::dvec3 p{2e-3 * unit(random), 2e-3 * unit(random), 0};
      const Query query = pair.query(PlatePair::tool_pose(turn, tilt, p), penetration::kDefaultSoftWidth_m, 50);
      Penetration at;
      back_end.evaluate({&query, 1}, {&at, 1});
      p.z = at.depth_m - 1e-3 * (0.175 + 0.125 * unit(random));
      poses.push_back(PlatePair::tool_pose(turn, tilt, p));
    }
  }
  return poses;
}

struct Errors {
  std::vector<double> depth_um, force, torque;

  void add(const Penetration& answer, const Penetration& truth) {
    depth_um.push_back(1e6 * std::abs(answer.depth_m - truth.depth_m));
    const double size = glm::length(force_N(truth));
    force.push_back(glm::distance(force_N(answer), force_N(truth)) / size);
    torque.push_back(glm::distance(torque_Nm(answer), torque_Nm(truth)) /
                     std::max(glm::length(torque_Nm(truth)), kLeastArm_m * size));
  }
  [[nodiscard]] double depth_rms_um() const {
    double square = 0;
    for (const double d : depth_um) square += d * d;
    return depth_um.empty() ? 0 : std::sqrt(square / static_cast<double>(depth_um.size()));
  }
};

json row_of(const Method& method, const PlatePair& pair, std::uint32_t n, const std::vector<spatial::Pose>& poses,
            const std::vector<Penetration>& truths, const Options& options) {
  Errors errors;
  for (std::size_t i = 0; i < poses.size(); ++i) errors.add(method.answer(pair, poses[i], n), truths[i]);
  std::vector<double> us;
  double jump_N = 0;
  DeviceTimes device;
  glm::dvec3 last{0};
  const std::size_t frames = method.is_slow ? options.slow_slide : options.slide;
  for (std::size_t k = 0; k < frames; ++k) {
    spatial::Pose X_CT = poses.front();
    X_CT.p += static_cast<double>(k) * kSlideStep_m * glm::dvec3{0.8, 0.6, 0};
    const auto start = std::chrono::steady_clock::now();
    const Penetration at = method.answer(pair, X_CT, n);
    us.push_back(us_since(start));
    if (method.named && method.named->last_egl()) device.add(method.named->last_egl()->tally());
    const glm::dvec3 force = force_N(at);
    if (k > 0) jump_N = std::max(jump_N, glm::distance(force, last));
    last = force;
  }
  json row{{"method", method.name},
           {"backend", method.back_end_name},
           {"n", n},
           {"scene", pair.name()},
           {"us", quantile(us, 0.5)},
           {"depth_rms_um", errors.depth_rms_um()},
           {"depth_max_um", quantile(errors.depth_um, 1)},
           {"force_err_median", quantile(errors.force, 0.5)},
           {"force_err_p95", quantile(errors.force, 0.95)},
           {"force_err_max", quantile(errors.force, 1)},
           {"torque_err_median", quantile(errors.torque, 0.5)},
           {"torque_err_p95", quantile(errors.torque, 0.95)},
           {"jump_N", jump_N}};
  device.write(row);
  if (method.named) row.update(method.named->about());
  return row;
}

/// Depth only: a mesh's facets have no gradient worth comparing.
void add_peers(const PlatePair& pair, const std::vector<spatial::Pose>& poses, const std::vector<Penetration>& truths,
               json& rows) {
  const FullMeshes meshes(pair);
  const auto add = [&](const char* method, const char* back_end, std::uint32_t n, const auto& depth_m) {
    std::vector<double> us;
    double square = 0, greatest = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      const double error_um = 1e6 * std::abs(depth_m(poses[i]) - truths[i].depth_m);
      us.push_back(us_since(start));
      square += error_um * error_um;
      greatest = std::max(greatest, error_um);
    }
    rows.push_back({{"method", method},
                    {"backend", back_end},
                    {"n", n},
                    {"scene", pair.name()},
                    {"us", quantile(us, 0.5)},
                    {"depth_rms_um", std::sqrt(square / static_cast<double>(poses.size()))},
                    {"depth_max_um", greatest}});
  };
  add("rays", "embree, 65,522 triangles", 50, [&](const spatial::Pose& X) { return meshes.cast_m(X, 50); });
  add("exact", "overlay of 65,522 triangles", 0, [&](const spatial::Pose& X) { return meshes.exact_m(X); });
}

/// Seven contacts in one call, each sliding its own way, from every scene in turn.
json seven_contacts(const std::vector<std::unique_ptr<PlatePair>>& pairs,
                    const std::vector<std::vector<spatial::Pose>>& poses, double soft_width_m, const Options& options) {
  const auto simd = make_simd(kLimits);
  std::vector<double> us;
  std::array<Query, 7> queries;
  std::array<Penetration, 7> answers;
  for (std::size_t frame = 0; frame < options.frames; ++frame) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const std::size_t p = i % pairs.size();
      spatial::Pose X_CT = poses[p][(i / pairs.size()) % poses[p].size()];
      const double along = kSlideStep_m * static_cast<double>(frame % 400);
      X_CT.p += along * glm::dvec3{std::cos(static_cast<double>(i)), std::sin(static_cast<double>(i)), 0};
      queries[i] = pairs[p]->query(X_CT, soft_width_m, 50);
    }
    const auto start = std::chrono::steady_clock::now();
    simd->evaluate(queries, answers);
    us.push_back(us_since(start));
  }
  return {{"p50_us", quantile(us, 0.5)}, {"p99_us", quantile(us, 0.99)}, {"p99_9_us", quantile(us, 0.999)}};
}

void print(const json& row) {
  fmt::print("{:8} {:14} {:28} {:4} {:9.1f} us  depth {:8.3f} um", row["scene"].get<std::string>(),
             row["method"].get<std::string>(), row["backend"].get<std::string>(), row["n"].get<int>(),
             row["us"].get<double>(), row["depth_rms_um"].get<double>());
  if (row.contains("jump_N")) {
    fmt::print("  force {:6.3f} % (p95 {:6.2f})  torque {:6.3f} %  jump {:.3f} N",
               100 * row["force_err_median"].get<double>(), 100 * row["force_err_p95"].get<double>(),
               100 * row["torque_err_median"].get<double>(), row["jump_N"].get<double>());
  }
  fmt::print("\n");
}

void write_csv(const std::string& path, const json& rows) {
  std::ofstream file(path);
  const std::vector<std::string> columns{
      "method",        "backend",           "n",     "scene", "us", "depth_rms_um", "force_err_median",
      "force_err_p95", "torque_err_median", "jump_N"};
  fmt::print(file, "{}\n", fmt::join(columns, ","));
  for (const json& row : rows) {
    std::vector<std::string> cells;
    for (const std::string& column : columns) cells.push_back(row.contains(column) ? row[column].dump() : "");
    fmt::print(file, "{}\n", fmt::join(cells, ","));
  }
}

json pairs_of_plates(const Options& options) {
  const auto reference = make_reference(kLimits), truth = make_reference(kLimits, penetration::kTruth);
  const auto best = make_simd(kLimits), avx2 = make_simd(kLimits, InstructionSet::kAvx2),
             plain = make_simd(kLimits, InstructionSet::kPlain);
  const auto simd_name = [](InstructionSet set) {
    return fmt::format("simd {}", penetration::instruction_set_name(set));
  };
  std::vector<Method> methods;
  for (const double w : {5e-6, 10e-6, 20e-6, 50e-6}) {
    methods.push_back({.name = fmt::format("soft {:.0f} um", 1e6 * w),
                       .back_end_name = simd_name(InstructionSet::kBest),
                       .back_end = best.get(),
                       .soft_width_m = w,
                       .samples = options.samples});
  }
  methods.push_back({"hard", simd_name(InstructionSet::kBest), best.get(), 0, true, false, false, options.samples});
  methods.push_back({"soft 10 um", simd_name(InstructionSet::kAvx2), avx2.get(), 10e-6, true, false, false, {50}});
  methods.push_back({"soft 10 um", simd_name(InstructionSet::kPlain), plain.get(), 10e-6, true, false, false, {50}});
  methods.push_back({"soft 10 um", "reference", reference.get(), 10e-6, true, false, true, {50}});
  methods.push_back({"hard", "reference", reference.get(), 0, true, false, true, {50}});
  methods.push_back({"eleven grids", "reference", reference.get(), 0, false, true, true, options.samples});

  std::vector<std::unique_ptr<NamedBackEnd>> named;
  std::vector<std::unique_ptr<BackEnd>> others;
  for (const std::string& name : options.back_ends) {
    if (name == "simd") continue;  // always there
    named.push_back(std::make_unique<NamedBackEnd>(name));
    others.push_back(named.back()->maker()(kLimits));
    const auto add = [&](const std::string& method, double w, bool refines, bool by_differences) {
      methods.push_back(
          {method, name, others.back().get(), w, refines, by_differences, true, options.samples, named.back().get()});
    };
    if (name == "egl") add("soft 10 um", 10e-6, true, false), add("hard", 0, true, false);
    if (name == "egl") add("eleven grids", 0, false, true);
    if (name == "historical") add("eleven grids", 0, false, false);
  }

  json rows = json::array();
  std::vector<std::unique_ptr<PlatePair>> pairs;
  std::vector<std::vector<spatial::Pose>> poses;
  for (const std::string& scene : options.scenes) {
    pairs.push_back(plate_pair(scene));
    const PlatePair& pair = *pairs.back();
    for (const auto& other : others) pair.prepare(*other);
    poses.push_back(poses_of(pair, *best, options));
    std::vector<std::pair<double, std::vector<Penetration>>> truths;  // by soft width
    const auto truths_for = [&](double w) -> const std::vector<Penetration>& {
      for (const auto& [width, answers] : truths) {
        if (width == w) return answers;
      }
      const Method exact{
          .name = "truth", .back_end_name = "", .back_end = truth.get(), .soft_width_m = w, .samples = {}};
      std::vector<Penetration> answers;
      for (const spatial::Pose& X_CT : poses.back()) answers.push_back(exact.answer(pair, X_CT, 300));
      return truths.emplace_back(w, std::move(answers)).second;
    };
    for (const Method& method : methods) {
      for (const std::uint32_t n : method.samples) {
        rows.push_back(row_of(method, pair, n, poses.back(), truths_for(method.soft_width_m), options));
        print(rows.back());
      }
    }
    const std::size_t own = rows.size();
    add_peers(pair, poses.back(), truths_for(0), rows);
    for (std::size_t i = own; i < rows.size(); ++i) print(rows[i]);
  }
  json result{{"rows", rows},
              {"seven_contacts", seven_contacts(pairs, poses, penetration::kDefaultSoftWidth_m, options)},
              {"seven_hard_contacts", seven_contacts(pairs, poses, 0, options)}};
  for (const auto& [key, method] : {std::pair{"seven_contacts", "soft 10 um"}, {"seven_hard_contacts", "hard"}}) {
    const json& times = result[key];
    fmt::print("seven contacts, {}: p50 {:.0f}, p99 {:.0f}, p99.9 {:.0f} us\n", method, times["p50_us"].get<double>(),
               times["p99_us"].get<double>(), times["p99_9_us"].get<double>());
  }
  return result;
}

json run(const Options& options) {
  json result = options.only_slid ? json::object() : pairs_of_plates(options);
  result["slid"] = slid_rows(options.slid);
  return result;
}

}  // namespace

void add_penetration(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("penetration", "Penetration depth: time against error, method by method");
  app->add_option("--scene", options->scenes, "ridged, rough, scan");
  app->add_option("--seed", options->seeds, "of the poses");
  app->add_option("--n", options->samples, "samples a side");
  app->add_option("--poses", options->poses, "a seed, compared with truth")->check(CLI::Range(1, 1000));
  app->add_option("--pattern", options->slid.patterns, "of the slid answers; none: all");
  app->add_option("--slid-poses", options->slid.poses, "a pattern, slid to and asked afresh")
      ->check(CLI::Range(1, 1000));
  app->add_option("--slid-width", options->slid.widths_m, "soft widths of the slid answers [m]");
  app->add_flag("--only-slid", options->only_slid, "Leave out everything but the slid answers");
  app->add_option("--frames", options->frames, "of seven contacts")->check(CLI::Range(1, 1'000'000));
  app->add_option("--backend", options->back_ends, "more of them: egl, historical")
      ->check(CLI::IsMember({"simd", "egl", "historical"}));
  app->add_option("--svg", options->svg, "Write a plot of time against force error");
  app->add_option("--csv", options->csv, "Write the table");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] {
    const json result = run(*options);
    if (!options->csv.empty() && !options->only_slid) write_csv(options->csv, result["rows"]);
    if (!options->svg.empty() && !options->only_slid) {
      std::vector<PlotPoint> points;
      for (const json& row : result["rows"]) {
        if (!row.contains("force_err_median")) continue;
        points.push_back({.label = fmt::format("{}, {}, {}, N = {}", row["scene"].get<std::string>(),
                                               row["method"].get<std::string>(), row["backend"].get<std::string>(),
                                               row["n"].get<int>()),
                          .group = row["method"].get<std::string>(),
                          .x = row["us"].get<double>(),
                          .y = 100 * row["force_err_median"].get<double>()});
      }
      write_pareto_plot(options->svg, "time of a contact [us]", "median force error [%]", points);
    }
    if (options->as_json) fmt::print("{}\n", result.dump());
  });
}

}  // namespace farfeel::bench
