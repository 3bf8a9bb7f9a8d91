// What breaks a haptic loop: surfaces that change under the tool, links that stall, contacts that are renamed. Each
// case presses or strokes in simulated time and is judged by the gates below.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/hardcases_jobs.h"
#include "tests/bench/hardcases_loop.h"
#include "tests/bench/known_failures.h"
#include "tests/support/analytic_remote.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using test_support::AnalyticRemote;

constexpr int kBefore = 1500, kAfter = 2000, kJudged = 500;  // ms before and after the event, and judged at the end
constexpr double kPress_N = 3;
struct Case {
  std::string title;
  std::function<void(AnalyticRemote&)> before;             ///< sets the scene
  std::function<void(AnalyticRemote&, int)> at_and_after;  ///< the event at 0 ms, and what goes on, each ms
  bool is_stroked = false;                                 ///< explored instead of held: texture is no ripple

  [[nodiscard]] const std::string& name() const { return title; }
};

const std::vector<glm::dvec3> kPlate{{0.09, 0.011, 0}, {0.09, -0.011, 0}, {-0.09, 0.011, 0}, {-0.09, -0.011, 0}};

std::vector<Case> cases() {
  const auto at_0 = [](auto&& change) {
    return [change](AnalyticRemote& remote, int tick) {
      if (tick == 0) change(remote);
    };
  };
  const auto nothing = [](AnalyticRemote&, int) {};
  const auto flat = [](AnalyticRemote&) {};
  std::vector<Case> all{
      {"flat on flat", flat, nothing},
      {"needle tip",
       [](AnalyticRemote& remote) {
         remote.world.points_T = {{0, 0, 0}};
       },
       nothing},
      {"wall rises 1.5 mm", flat, at_0([](AnalyticRemote& remote) { remote.world.level_m = 0.0015; })},
      {"wall sinks 1.5 mm", flat, at_0([](AnalyticRemote& remote) { remote.world.level_m = -0.0015; })},
      {"wall removed", flat, at_0([](AnalyticRemote& remote) { remote.world.level_m = -0.2; })},
      {"stiffness times 5", flat, at_0([](AnalyticRemote& remote) { remote.world.material.stiffness_N_per_m *= 5; })},
      {"direction turns 25 degrees", flat, at_0([](AnalyticRemote& remote) {
         remote.on_answer = [](contact::ContactSet& set) {
           const double angle = 25 * std::numbers::pi / 180;
           for (std::size_t i = 0; i < set.count; ++i) {
             contact::Contact& contact = set.contacts[i];
             const glm::dvec3 n{std::sin(angle), 0, std::cos(angle)};
             contact.nhat_ST_W = n;
             contact.gradient = spatial::to_vector6(spatial::Twist{glm::cross(contact.p_WC_W - set.X_WT.p, -n), -n});
           }
         };
       })},
      {"clusters renamed with every answer", flat, at_0([](AnalyticRemote& remote) {
         remote.on_answer = [](contact::ContactSet& set) {
           for (std::size_t i = 0; i < set.count; ++i) set.contacts[i].id.number += 100 * (set.pose_sequence + 1);
         };
       })},
      {"texture swapped while touched",
       [](AnalyticRemote& remote) { remote.world.amplitude_m = 0.0001, remote.world.period_m = 0.004; },
       at_0([](AnalyticRemote& remote) { remote.world.amplitude_m = 0.0003, remote.world.period_m = 0.0015; })},
      {"link stalls 1 s and returns", flat, [](AnalyticRemote& remote, int tick) { remote.is_silent = tick < 1000; }},
      {"link stalls 1 s, the wall has risen", flat,
       [](AnalyticRemote& remote, int tick) {
         remote.is_silent = tick < 1000;
         if (tick == 500) remote.world.level_m = 0.002;
       }},
      {"absurd depth", flat, at_0([](AnalyticRemote& remote) {
         remote.on_answer = [](contact::ContactSet& set) {
           for (std::size_t i = 0; i < set.count; ++i) set.contacts[i].depth_m = 0.5;
         };
       })},
  };
  for (double pitch_mm : {1.0, 2.0, 4.0})
    all.push_back({fmt::format("ridges of {:.0f} mm stroked at 10-300 mm/s", pitch_mm),
                   [pitch_mm](AnalyticRemote& remote) {
                     remote.world.amplitude_m = 0.05e-3 * pitch_mm;
                     remote.world.period_m = 1e-3 * pitch_mm;
                   },
                   nothing, true});
  return all;
}

LoopCaseRow run(const Case& tried, const LoopJob& job) {
  const auto& [rung, grip, link, mass_kg, tick_ns, stiffness_N_per_m, contact] = job;
  const int a_ms = static_cast<int>(1'000'000 / tick_ns);
  SimulatedDeviceSettings device_settings;
  device_settings.grip = grip;
  device_settings.explorer.hints = {.p_TWork_T = {0, 0, 0},
                                    .nhat_work_T = {0, 0, -1},
                                    .region_low_W = {-0.04, -0.03, 0},
                                    .region_high_W = {0.04, 0.03, 0},
                                    .approach_W = {0, 0, -1},
                                    .press_force_N = kPress_N,
                                    .stroke_speed_m_per_s = 0.1};
  SimulatedDevice device(device_settings);
  AnalyticRemote remote;
  remote.world.points_T = kPlate;
  remote.world.near_m = 0.02;
  remote.answer_period_ns = 2'000'000;
  remote.set_link(link);
  if (stiffness_N_per_m > 0) remote.world.material.stiffness_N_per_m = stiffness_N_per_m;
  tried.before(remote);
  HapticLoopSettings settings;
  settings.timing.period_ns = tick_ns;
  settings.local_model.contact = contact;
  settings.body = tool::with_mass({0.05, Eigen::Vector3d(3e-6, 1.7e-4, 1.7e-4).asDiagonal()}, mass_kg);
  HapticLoop loop(device, remote, settings);
  if (!tried.is_stroked) {
    spatial::Pose X_WHand = device.true_pose();
    X_WHand.p.z = -kPress_N / grip.stiffness_N_per_m;
    device.hold_at(X_WHand);
  }
  LoopWatch watch(tick_ns);
  for (int i = 0; i < a_ms * (kBefore + kAfter); ++i) {
    if (i >= a_ms * kBefore && i % a_ms == 0) tried.at_and_after(remote, i / a_ms - kBefore);
    loop.tick({i * tick_ns, 0, 0, 0});
    watch.look(loop, remote.world.material.stiffness_N_per_m * static_cast<double>(remote.world.points_T.size()),
               i >= a_ms * kBefore, i >= a_ms * (kBefore + kAfter - kJudged));
  }
  LoopCaseRow row = row_of(tried.name(), job, watch.figures(loop, device));
  const LoopFigures& f = row.figures;
  row.passes = is_sound(f, loop) && (tried.is_stroked || (f.step_N <= std::max(kMaxStep_N, kMaxStepShare * f.force_N) &&
                                                          f.ripple_share <= kMaxRipple));
  return row;
}

struct Family {
  std::vector<LoopCaseRow> (*judge)(const LoopCaseChoice&);
  std::size_t kinds, links;  ///< of rung, grip and mass together, and links beside none, that each case meets
};
constexpr Family kFamilies[] = {{judge_changes, 4, 3},
                                {judge_real_shapes, 4, 2},
                                {judge_jabs, 4, 1},
                                {judge_moving_objects, 8, 3},
                                {judge_busy_machines, 4, 1}};

/// Which of `all` it is; at the end of them when it is new.
std::size_t place_in(std::vector<std::string>& all, const std::string& one) {
  const auto at = std::find(all.begin(), all.end(), one);
  const auto place = static_cast<std::size_t>(at - all.begin());
  if (at == all.end()) all.push_back(one);
  return place;
}

/// Of each case one kind alone, without a link and behind one of its links, each another from case to case.
std::function<bool(const LoopCaseRow&)> is_in_short_form(const Family& family) {
  struct Seen {
    std::size_t cases = 0;
    std::string name;
    std::vector<std::string> kinds, links;
  };
  return [family, seen = std::make_shared<Seen>()](const LoopCaseRow& row) {
    if (row.name != seen->name) *seen = {.cases = seen->cases + 1, .name = row.name, .kinds = {}, .links = {}};
    constexpr std::size_t kStride = 3;  // through four or eight kinds, not in their order
    if (place_in(seen->kinds, fmt::format("{} {} {}", row.rung, row.grip, row.mass_kg)) !=
        kStride * seen->cases % family.kinds)
      return false;
    return row.link.round_trip_ns == 0 ||
           place_in(seen->links, fmt::format("{} {}", row.link.round_trip_ns, row.link.jitter_ns)) ==
               seen->cases % family.links;
  };
}

int run_all(bool is_json, bool is_quick, LoopCaseChoice choice) {
  std::vector<LoopCaseRow> rows;
  for (const Family& family : kFamilies) {
    if (is_quick) choice.takes = is_in_short_form(family);
    for (LoopCaseRow& row : with_forces_judged(family.judge(choice))) rows.push_back(std::move(row));
  }
  if (rows.empty()) throw CLI::ValidationError("--only", "no case's name contains \"" + choice.only + "\"");
  nlohmann::json told = nlohmann::json::array();
  CountedRows counted;
  fmt::print("{:38} {:>7} {:>5} {:>6} {:>6} {:>5} {:>6} {:>7} {:>7} {:>8} {:>6} {:>9} {:>9} {:>9} {:>6} {}\n", "case",
             "rung", "grip", "rtt ms", "jit ms", "loss", "mass g", "step N", "ripple", "force N", "of it", "largest N",
             "device J", "contact J", "trunc", "verdict");
  for (const LoopCaseRow& row : rows) {
    const LoopFigures& f = row.figures;
    const double rtt_ms = 1e-6 * static_cast<double>(row.link.round_trip_ns),
                 jitter_ms = 1e-6 * static_cast<double>(row.link.jitter_ns);
    fmt::print(
        "{:38} {:>7} {:>5} {:6.0f} {:6.0f} {:5.2f} {:6.0f} {:7.3f} {:7.3f} {:8.2f} {:6.2f} {:9.2f} {:9.1e} {:9.1e} "
        "{:6} "
        "{}\n",
        row.name, row.rung, row.grip, rtt_ms, jitter_ms, row.link.loss, 1e3 * row.mass_kg, f.step_N, f.ripple_share,
        f.force_N, row.force_share, f.largest_N, f.device_min_J, f.contact_excess_J, f.truncations,
        counted.count(HardCases::kLoop, row.passes, row.name));
    told.push_back({{"case", row.name},
                    {"rung", row.rung},
                    {"grip", row.grip},
                    {"tick_hz", row.tick_hz},
                    {"rtt_ms", rtt_ms},
                    {"jitter_ms", jitter_ms},
                    {"loss", row.link.loss},
                    {"mass_kg", row.mass_kg},
                    {"step_N", f.step_N},
                    {"ripple_share", f.ripple_share},
                    {"force_N", f.force_N},
                    {"force_share", row.force_share},
                    {"largest_N", f.largest_N},
                    {"device_min_J", f.device_min_J},
                    {"contact_excess_J", f.contact_excess_J},
                    {"truncations", f.truncations},
                    {"passes", row.passes},
                    {"known", known_failure(HardCases::kLoop, row.name)}});
  }
  counted.print();
  if (is_json)
    fmt::print("{}\n",
               nlohmann::json{{"rows", told}, {"failed", counted.failed()}, {"unknown", counted.unknown()}}.dump());
  return counted.unknown();
}

}  // namespace

std::vector<LoopCaseRow> judge_changes(const LoopCaseChoice& choice) {
  std::vector<LoopJob> jobs;
  for (const Grip& grip : {kSoftGrip, kHardGrip})
    for (const transport::LinkSpec& link : links_of(choice, {50, 200}))
      for (const double mass_kg : {0.001, 0.1})
        jobs.push_back({local_model::Rung::kLinear, grip, link, mass_kg, choice.tick_ns(), choice.stiffness_N_per_m});
  return run_jobs(cases(), jobs, choice, run);
}

/// A contact that is lost makes no ripple and no step: it is told by the force of the same row without a link. A
/// third of it, because what the tank does not pay for of a surface that was told late stays away.
constexpr double kLeastForceShare = 1.0 / 3;

std::vector<LoopCaseRow> with_forces_judged(std::vector<LoopCaseRow> rows) {
  for (LoopCaseRow& row : rows) {
    const auto same = std::find_if(rows.begin(), rows.end(), [&row](const LoopCaseRow& other) {
      return other.link.round_trip_ns == 0 && other.name == row.name && other.rung == row.rung &&
             other.grip == row.grip && other.mass_kg == row.mass_kg;
    });
    constexpr double kNothing_N = 0.05;  // what a wall that is gone leaves
    if (same != rows.end() && same->figures.force_N > kNothing_N)
      row.force_share = row.figures.force_N / same->figures.force_N;
    row.passes = row.passes && row.force_share >= kLeastForceShare;
  }
  return rows;
}

void add_hardcases_loop(CLI::App& hardcases) {
  CLI::App* command =
      hardcases.add_subcommand("loop", "Of the haptic loop: changes in mid-contact, stalls, real shapes, jabs");
  struct Options {
    bool is_json = false, is_quick = false;
    LoopCaseChoice choice;
    int rate_hz = 1000;
    std::string link, contact = "penalty";
    double stiffness_N_per_mm = 0;
  };
  const auto options = std::make_shared<Options>();
  command->add_flag("--json", options->is_json, "One JSON object as the last line");
  command->add_flag("--quick", options->is_quick,
                    "Of each case one rung, grip and mass, without a link and behind one: the same rows each time");
  command->add_option("--only", options->choice.only, "Cases whose name contains this");
  command->add_option("--rate", options->rate_hz, "Ticks a second")
      ->check(CLI::IsMember({1000, 2000, 4000, 5000}))
      ->capture_default_str();
  command->add_option("--link", options->link,
                      "Beside no link this one, in place of the list's: rtt=100ms jitter=10ms loss=2%,burst=5");
  command->add_option("--stiffness", options->stiffness_N_per_mm, "Of a contact [N/mm]; else as its material says")
      ->check(CLI::Range(0.05, 20.0));
  command->add_option("--contact", options->contact, "How contacts push: as springs, or as constraints")
      ->check(CLI::IsMember({"penalty", "constraint"}))
      ->capture_default_str();
  command->callback([options] {
    options->choice.contact = local_model::find_contact_law(options->contact).value();
    options->choice.stiffness_N_per_m = 1e3 * options->stiffness_N_per_mm;
    if (!options->link.empty()) {
      const auto spec = transport::parse_link_spec(options->link);
      if (!spec) throw CLI::ValidationError("--link", spec.error().message);
      options->choice.link = *spec;
    }
    options->choice.ticks_a_ms = options->rate_hz / 1000;
    if (run_all(options->is_json, options->is_quick, options->choice) > 0) throw CLI::RuntimeError(1);
  });
}

}  // namespace farfeel::bench
