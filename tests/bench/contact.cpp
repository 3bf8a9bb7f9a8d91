// The whole contact frame: proximity, clusters, penetration depth, wrench. How long it takes along a recorded motion,
// and how far its wrench is from the reference's and from the converged integral's on the same frames.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "haptic_core/contact/doubts.h"
#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "slave_sim/depths/chosen_depths.h"
#include "tests/bench/bench.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/force_jumps.h"
#include "tests/bench/named_back_end.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using nlohmann::json;

constexpr double kLever_m = 0.05;       // torque counts as the force that makes it at this arm
constexpr double kLeastForce_N = 0.05;  // errors are relative: frames with less are left out
constexpr std::uint32_t kTruthSamples = 300;

struct Options {
  std::string penetration = "simd";
  std::vector<std::string> scenes{benchmark_scene_names().begin(), benchmark_scene_names().end()};
  std::vector<std::uint64_t> seeds = {1, 2, 3};
  std::size_t frames = 2000, checked = 200, truths = 50, passes = 1;
  bool as_json = false;
};

/// Without friction the wrench is a function of the pose: stick and slip would part two services for good at the first
/// small difference.
contact_service::ContactService service(const BenchmarkScene& scene, const penetration::BackEndMaker& maker,
                                        bool has_friction = false, std::uint32_t samples = 50) {
  contact_service::TouchableObject S{&scene.object.felt, scene.object.material, {}},
      T{&scene.tool.felt, scene.tool.material, {}};
  if (!has_friction) S.material.static_friction = S.material.dynamic_friction = 0;
  return {{&S, 1}, T, {.tolerance_m = scene.tolerance_m, .grid_samples = samples, .maker = maker}};
}

contact_service::ToolPose tool_pose(const std::vector<spatial::Pose>& motion, std::size_t i) {
  return {.sequence = static_cast<std::uint32_t>(i),
          .time_ns = static_cast<std::int64_t>(i) * 1'000'000,
          .X_WT = motion[i],
          .V_WT_W = {}};
}

double size_of(const spatial::Wrench& F) {
  return std::hypot(glm::length(F.force_N), glm::length(F.torque_Nm) / kLever_m);
}

/// In the order of StageTimes; the last is the whole frame's.
constexpr std::array kStages{&contact_service::StageTimes::proximity_us, &contact_service::StageTimes::clusters_us,
                             &contact_service::StageTimes::penetration_us, &contact_service::StageTimes::assembly_us,
                             &contact_service::StageTimes::total_us};

struct Tally {
  std::vector<contact_service::StageTimes> times;  // of each frame
  std::vector<double> wrench_err, truth_err;
  double pairs = 0, contacts = 0, touching = 0, jump_max_N = 0;
  contact::DoubtCounts doubts;
  std::uint32_t contacts_max = 0;
  const NamedBackEnd* measured = nullptr;
  DeviceTimes device;
  std::vector<double> simd_err;
  ForceJumps jumps;
};

/// The same motion once more: of each frame's times the least count, since other work on the machine only adds to them.
void time_again(const BenchmarkScene& scene, const std::vector<spatial::Pose>& motion,
                std::span<contact_service::StageTimes> least) {
  contact_service::ContactService timed = service(scene, scene.maker, true);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const contact_service::StageTimes& t = timed.answer(tool_pose(motion, i)).times;
    for (double contact_service::StageTimes::*stage : kStages) least[i].*stage = std::min(least[i].*stage, t.*stage);
  }
}

void time_motion(const BenchmarkScene& scene, const std::vector<spatial::Pose>& motion, Tally& tally) {
  contact_service::ContactService timed = service(scene, scene.maker, true);
  spatial::Wrench last;
  tally.jumps.restart();
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const contact_service::Answer& set = timed.answer(tool_pose(motion, i));
    const contact_service::StageTimes& t = set.times;
    tally.times.push_back(t);
    if (t.grids > 0 && tally.measured->last_egl()) tally.device.add(tally.measured->last_egl()->tally());
    tally.pairs += set.pairs_near;
    tally.doubts.add(set);
    const auto felt = static_cast<std::uint32_t>(std::count_if(set.contacts.begin(), set.contacts.begin() + set.count,
                                                               [](const auto& c) { return c.depth_m > 0; }));
    tally.contacts += felt;
    tally.touching += felt > 0;
    tally.contacts_max = std::max(tally.contacts_max, felt);
    if (i > 0) tally.jump_max_N = std::max(tally.jump_max_N, glm::distance(set.F_To_W.force_N, last.force_N));
    last = set.F_To_W;
    tally.jumps.add(set);
  }
}

/// What the slowest hundredth of the frames did, of those that took so long or longer.
json slowest(std::span<const contact_service::StageTimes> frames, double from_us) {
  std::array<double, kStages.size()> mean_us{};
  double count = 0, grids = 0, with_points = 0;
  for (const contact_service::StageTimes& t : frames) {
    if (t.total_us < from_us) continue;
    ++count, grids += t.grids, with_points += t.point_contacts > 0;
    for (std::size_t stage = 0; stage < kStages.size(); ++stage) mean_us[stage] += t.*kStages[stage];
  }
  for (double& us : mean_us) us /= count;
  return {
      {"frames", count},
      {"stage_us",
       {{"proximity", mean_us[0]}, {"clusters", mean_us[1]}, {"penetration", mean_us[2]}, {"assembly", mean_us[3]}}},
      {"grids_mean", grids / count},
      {"with_points", with_points / count}};
}

/// Services keep their contacts' history, so those that are compared see the same poses: some in a row, at the motion's
/// own rate, from places all along it, at each of which both begin anew.
void compare(const BenchmarkScene& scene, const std::vector<spatial::Pose>& motion, std::size_t count,
             const penetration::BackEndMaker& other, std::uint32_t samples, std::vector<double>& errors) {
  constexpr std::size_t kInARow = 5;
  const std::size_t every = std::max(kInARow, kInARow * motion.size() / std::max<std::size_t>(count, 1));
  contact_service::ContactService fast = service(scene, scene.maker), slow = service(scene, other, false, samples);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    if (i % every >= kInARow) continue;
    if (i % every == 0) fast.restart(), slow.restart();
    const spatial::Wrench F = fast.answer(tool_pose(motion, i)).F_To_W, G = slow.answer(tool_pose(motion, i)).F_To_W;
    if (size_of(G) > kLeastForce_N) errors.push_back(size_of(F + -1.0 * G) / size_of(G));
  }
}

/// Of the same frames, by the back end that is measured and by simd.
void compare_with_simd(const BenchmarkScene& scene, const std::vector<spatial::Pose>& motion,
                       std::vector<double>& errors) {
  contact_service::ContactService ours = service(scene, scene.maker), theirs = service(scene, {});
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const spatial::Wrench F = ours.answer(tool_pose(motion, i)).F_To_W, G = theirs.answer(tool_pose(motion, i)).F_To_W;
    if (size_of(G) > kLeastForce_N) errors.push_back(size_of(F + -1.0 * G) / size_of(G));
  }
}

json run(const BenchmarkScene& scene, const NamedBackEnd& measured, const Options& options) {
  Tally tally;
  tally.measured = &measured;
  for (const std::uint64_t seed : options.seeds) {
    const std::vector<spatial::Pose> motion = scene.motion(seed, options.frames);
    time_motion(scene, motion, tally);
    for (std::size_t pass = 1; pass < options.passes; ++pass) {
      time_again(scene, motion, std::span(tally.times).last(motion.size()));
    }
    if (scene.maker) compare_with_simd(scene, motion, tally.simd_err);
    compare(scene, motion, options.checked, penetration::reference_maker(), 50, tally.wrench_err);
    compare(scene, motion, options.truths, penetration::reference_maker(penetration::kTruth), kTruthSamples,
            tally.truth_err);
  }
  const auto n = static_cast<double>(tally.times.size());
  std::array<double, kStages.size()> mean_us{};
  std::vector<double> total_us;
  for (const contact_service::StageTimes& t : tally.times) {
    for (std::size_t stage = 0; stage < kStages.size(); ++stage) mean_us[stage] += t.*kStages[stage] / n;
    total_us.push_back(t.total_us);
  }
  const double p50 = quantile(total_us, 0.5);
  json causes = json::object();
  for (std::size_t i = 0; i < kJumpCauses.size(); ++i) {
    const auto cause = static_cast<JumpCause>(i);
    causes[std::string(kJumpCauses[i])] = {{"max_N", tally.jumps.greatest_N(cause)},
                                           {"max_N_per_mm", tally.jumps.greatest_N_per_mm(cause)}};
  }
  json doubts = json::object();
  for (std::size_t d = 0; d < contact::kNamedDoubts.size(); ++d) {
    doubts[std::string(contact::kNamedDoubts[d].name)] = tally.doubts.share(d);
  }
  json row{
      {"p50_us", p50},
      {"p95_us", quantile(total_us, 0.95)},
      {"p99_us", quantile(total_us, 0.99)},
      {"max_us", quantile(total_us, 1)},
      {"slowest", slowest(tally.times, quantile(total_us, 0.99))},
      {"stage_us",
       {{"proximity", mean_us[0]}, {"clusters", mean_us[1]}, {"penetration", mean_us[2]}, {"assembly", mean_us[3]}}},
      {"contacts_mean", tally.touching > 0 ? tally.contacts / tally.touching : 0},
      {"contacts_max", tally.contacts_max},
      {"contact_share", tally.touching / n},
      {"pairs_mean", tally.pairs / n},
      {"updates_hz", 1e6 / p50},
      {"wrench_err_median", quantile(tally.wrench_err, 0.5)},
      {"wrench_err_p95", quantile(tally.wrench_err, 0.95)},
      {"truth_err_median", quantile(tally.truth_err, 0.5)},
      {"truth_err_p95", quantile(tally.truth_err, 0.95)},
      {"doubted_contacts", doubts},
      {"jump_max_N", tally.jump_max_N},
      {"jump_causes", causes}};
  tally.device.write(row);
  if (scene.maker) {
    row["simd_err_median"] = quantile(tally.simd_err, 0.5);
    row["simd_err_p95"] = quantile(tally.simd_err, 0.95), row["simd_err_max"] = quantile(tally.simd_err, 1);
  }
  return row;
}

}  // namespace

void add_contact(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app = bench.add_subcommand("contact", "The whole contact frame: time, and the wrench against truth");
  app->add_option("--penetration", options->penetration, "the back end that is measured")
      ->check(CLI::IsMember(slave_sim::depth_names()))
      ->capture_default_str();
  app->add_option("--scenes", options->scenes, "which scenes")->capture_default_str();
  app->add_option("--seeds", options->seeds, "of the recorded motions")->capture_default_str();
  app->add_option("--frames", options->frames, "a seed, at 1 kHz")->check(CLI::Range(1, 1'000'000));
  app->add_option("--passes", options->passes, "over each motion; a frame's time is the least")
      ->check(CLI::Range(1, 100));
  app->add_option("--checked", options->checked, "frames compared with the reference, a seed");
  app->add_option("--truths", options->truths, "frames compared with the converged integral, a seed");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] {
    json scenes = json::object();
    const NamedBackEnd measured(options->penetration);
    fmt::print("contact frame by {} with {} kernels, seeds {}\n", options->penetration,
               penetration::instruction_set_name(), fmt::join(options->seeds, " "));
    for (const std::string& name : options->scenes) {
      BenchmarkScene scene = benchmark_scene(name);
      scene.maker = measured.maker();
      const json& row = scenes[name] = run(scene, measured, *options);
      fmt::print(
          "{:12} p50 {:.0f} p95 {:.0f} p99 {:.0f} us; {:.1f} contacts (at most {}), {:.0f} pairs; wrench off the "
          "reference by {:.2f} % (p95 {:.1f} %), off truth by {:.2f} % (p95 {:.1f} %); jump {:.2f} N\n",
          name, row["p50_us"].get<double>(), row["p95_us"].get<double>(), row["p99_us"].get<double>(),
          row["contacts_mean"].get<double>(), row["contacts_max"].get<int>(), row["pairs_mean"].get<double>(),
          100 * row["wrench_err_median"].get<double>(), 100 * row["wrench_err_p95"].get<double>(),
          100 * row["truth_err_median"].get<double>(), 100 * row["truth_err_p95"].get<double>(),
          row["jump_max_N"].get<double>());
      const json &slow = row["slowest"], &slow_us = slow["stage_us"];
      fmt::print(
          "{:12} the slowest {:.0f} frames: proximity {:.0f}, depth {:.0f}, rest {:.0f} us; {:.1f} contacts asked for; "
          "points in {:.0f} %\n",
          "", slow["frames"].get<double>(), slow_us["proximity"].get<double>(), slow_us["penetration"].get<double>(),
          slow_us["clusters"].get<double>() + slow_us["assembly"].get<double>(), slow["grids_mean"].get<double>(),
          100 * slow["with_points"].get<double>());
      if (row.contains("simd_err_median")) {
        fmt::print("{:12} wrench off simd's by {:.3f} % (p95 {:.3f} %, at most {:.2f} %)\n", "",
                   100 * row["simd_err_median"].get<double>(), 100 * row["simd_err_p95"].get<double>(),
                   100 * row["simd_err_max"].get<double>());
      }
      for (const auto& [doubt, share] : row["doubted_contacts"].items()) {
        if (share > 0) fmt::print("{:12} {:.2f} % of the contacts: {}\n", "", 100 * share.get<double>(), doubt);
      }
      for (const auto& [cause, most] : row["jump_causes"].items()) {
        fmt::print("{:12} greatest jump of a contact where {:14} {:6.2f} N, {:6.1f} N/mm\n", "", cause,
                   most["max_N"].get<double>(), most["max_N_per_mm"].get<double>());
      }
    }
    json result{{"penetration", options->penetration}, {"scenes", scenes}};
    result.update(measured.about());
    if (options->as_json) fmt::print("{}\n", result.dump());
  });
}

}  // namespace farfeel::bench
