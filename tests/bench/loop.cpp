// The haptic loop across a link: how true each rung of the local model is to the surface, what it costs in bytes, and
// whether it is calm.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/loop_goals.h"
#include "tests/bench/loop_plot.h"
#include "tests/bench/loop_sweep.h"
#include "tests/bench/loop_tick.h"

namespace farfeel::bench {
namespace {

struct Options {
  bool as_json = false, is_quick = false, is_first_strokes = false;
  std::string plots, only, contact = "penalty";
};

void tell_progress(std::size_t done, std::size_t all) {
  if (::isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{} of {} cells{}", done, all, done == all ? "\n" : "");
}

std::vector<FreshStroke> first_strokes(std::span<const std::unique_ptr<StrokedScene>> scenes) {
  std::vector<FreshStroke> strokes;
  for (const auto& scene : scenes) {
    const ReplayTruth stroke(*scene, {{0.1, 0.050, 1}}, -0.025);
    const Replayed r = replay(stroke, local_model::Rung::kTiles, 1000, {.round_trip_ns = 100'000'000});
    strokes.push_back({scene->name(), r.tile_kB_s, r.all_tile_kB, 1e-3 * static_cast<double>(oracle_tile_bytes(stroke)),
                       std::lround(1000 * stroke.length_s()), r.late_ticks});
  }
  return strokes;
}

void print_table(const std::vector<LoopCell>& cells) {
  fmt::print(
      "{:9} {:>5} {:>6} {:>6} {:>5} {:10} {:>7} {:>7} {:>6} {:>6} {:>7} {:>8} {:>6} {:>14} {:>7} {:>7} {:>9} {:>9} "
      "{:>9} "
      "{}\n",
      "rung", "Hz", "rtt ms", "jitter", "loss", "scene", "force", "torque", "arm um", "late", "kB/s", "of tiles", "dB",
      "worst", ">100 Hz", "step N", "device J", "actuators", "contact J", "ripple", "truth's", "stable");
  for (const LoopCell& cell : cells) {
    const Replayed& r = cell.replayed;
    const ClosedLoop& c = cell.closed;
    const SpectrumError spectrum = cell.spectrum();
    const double above_dB = 10 * std::log10(power_from(c.contact, 100) / power_from(cell.truth->contact, 100));
    fmt::print(
        "{:9} {:5.0f} {:6.0f} {:6.0f} {:5.2f} {:10} {:7.3f} {:7.3f} {:6.1f} {:6.3f} {:7.1f} {:8.1f} {:6.2f} {:6.1f} "
        "{:4.0f} Hz "
        "{:7.2f} {:7.3f} {:9.1e} {:9.1e} {:9.1e} {:6.3f} {:6.3f} {}\n",
        local_model::name(cell.rung), cell.tick_hz, cell.rtt_ms, cell.jitter_ms, cell.loss, cell.scene->name(),
        r.force_share, r.torque_share, 1e6 * r.arm_off_m, r.late_share, r.contact_kB_s + r.tile_kB_s, r.tile_kB_s,
        spectrum.rms_dB, spectrum.worst_dB, spectrum.worst_Hz, above_dB, c.largest_step_N, c.device_min_J,
        c.actuators_min_J, c.contact_min_J, c.ripple_share, cell.truth->ripple_share, cell.is_stable() ? "yes" : "no");
  }
}

nlohmann::json row_of(const LoopCell& cell) {
  return {{"rung", local_model::name(cell.rung)},
          {"tick_hz", cell.tick_hz},
          {"rtt_ms", cell.rtt_ms},
          {"jitter_ms", cell.jitter_ms},
          {"loss", cell.loss},
          {"scene", cell.scene->name()},
          {"force_rmse_share", cell.replayed.force_share},
          {"torque_rmse_share", cell.replayed.torque_share},
          {"spectrum_db", cell.spectrum().rms_dB},
          {"step_N", cell.closed.largest_step_N},
          {"device_min_J", cell.closed.device_min_J},
          {"contact_min_J", cell.closed.contact_min_J},
          {"kB_s", cell.replayed.contact_kB_s + cell.replayed.tile_kB_s},
          {"stable", cell.is_stable()}};
}

/// What has no place in the rows, in their order.
nlohmann::json beside(const LoopCell& cell) {
  const SpectrumError spectrum = cell.spectrum();
  return {{"tile_kB_s", cell.replayed.tile_kB_s},
          {"outline_kB", cell.replayed.outline_kB},
          {"all_tile_kB", cell.replayed.all_tile_kB},
          {"late_share", cell.replayed.late_share},
          {"arm_off_um", 1e6 * cell.replayed.arm_off_m},
          {"truth_arm_um", 1e6 * cell.replayed.truth_arm_m},
          {"spectrum_worst_db", spectrum.worst_dB},
          {"spectrum_worst_Hz", spectrum.worst_Hz},
          {"above_100_Hz_N2", power_from(cell.closed.contact, 100)},
          {"truth_above_100_Hz_N2", power_from(cell.truth->contact, 100)},
          {"truth_step_N", cell.truth->largest_step_N},
          {"actuators_min_J", cell.closed.actuators_min_J},
          {"contact_bound_J", cell.closed.contact_bound_J},
          {"ripple_share", cell.closed.ripple_share}};
}

nlohmann::json told_of(const std::vector<FreshStroke>& strokes) {
  nlohmann::json told = nlohmann::json::array();
  for (const FreshStroke& stroke : strokes)
    told.push_back({{"scene", stroke.scene},
                    {"bytes", std::lround(1e3 * stroke.all_kB)},
                    {"oracle_bytes", std::lround(1e3 * stroke.oracle_kB)},
                    {"during_kB_s", stroke.during_kB_s},
                    {"ticks", stroke.ticks},
                    {"ticks_lacking", stroke.ticks_lacking}});
  return told;
}

nlohmann::json tell(const std::vector<Goal>& goals) {
  nlohmann::json told = nlohmann::json::array();
  fmt::print("\n");
  for (const Goal& goal : goals) {
    fmt::print("{:8} {:.3g} {} (goal {:.3g}): {}{}{}\n", goal.is_met() ? "met" : "NOT MET", goal.value, goal.unit,
               goal.bound, goal.what, goal.worst.empty() ? "" : "; ", goal.worst);
    told.push_back({{"goal", goal.what},
                    {"value", goal.value},
                    {"bound", goal.bound},
                    {"unit", goal.unit},
                    {"worst", goal.worst},
                    {"met", goal.is_met()}});
  }
  return told;
}

void tell_first_strokes(const std::vector<FreshStroke>& strokes, bool as_json) {
  const nlohmann::json told = tell(goals_of(strokes));
  if (as_json) fmt::print("{}\n", nlohmann::json{{"prefetch", told_of(strokes)}, {"goals", told}}.dump());
}

void run(const Options& options) {
  const auto scenes = stroked_scenes(options.is_quick ? SceneChoice::kOne : SceneChoice::kAll);
  if (options.is_first_strokes) return tell_first_strokes(first_strokes(scenes), options.as_json);
  LoopGrid grid = options.is_quick ? quick_grid() : full_grid();
  grid.only = options.only;
  grid.contact = local_model::find_contact_law(options.contact).value();
  const LoopSweep swept = sweep(scenes, grid, tell_progress);
  if (swept.cells.empty()) throw CLI::ValidationError("--only", "no cell's words contain \"" + options.only + "\"");
  print_table(swept.cells);
  nlohmann::json rows = nlohmann::json::array(), more = rows;
  for (const LoopCell& cell : swept.cells) rows.push_back(row_of(cell)), more.push_back(beside(cell));
  if (!options.only.empty()) {
    if (options.as_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}, {"beside", more}}.dump());
    return;
  }
  const TickTimes seven = time_seven_contacts(options.is_quick ? 2000 : 16000);
  fmt::print(
      "\nwhole ticks that feel {} contacts, windows of 64 x 64 texels: p50 {:.0f}, p99 {:.0f}, p99.9 {:.0f} us\n",
      seven.contacts, seven.p50_us, seven.p99_us, seven.p99_9_us);
  const std::vector<FreshStroke> fresh = first_strokes(scenes);
  const nlohmann::json told = tell(goals(swept.cells, fresh, seven));
  if (!options.plots.empty()) write_loop_plots(options.plots, swept.cells);
  if (!options.as_json) return;
  const nlohmann::json tick_us{
      {"contacts", seven.contacts}, {"p50", seven.p50_us}, {"p99", seven.p99_us}, {"p99_9", seven.p99_9_us}};
  fmt::print("{}\n", nlohmann::json{{"rows", rows},
                                    {"tick_us", {{"seven_contacts", tick_us}}},
                                    {"beside", more},
                                    {"prefetch", told_of(fresh)},
                                    {"goals", told}}
                         .dump());
}

}  // namespace

void add_loop(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app =
      bench.add_subcommand("loop", "How true each rung of the local model is, over rates, delays, jitter and loss");
  CLI::Option* quick = app->add_flag("--quick", options->is_quick, "Fewer rates, delays and scenes, shorter strokes");
  CLI::Option* plots = app->add_option("--plots", options->plots, "Folder for loop-delay.svg and loop-bandwidth.svg")
                           ->check(CLI::ExistingDirectory)
                           ->excludes(quick);
  app->add_option("--only", options->only,
                  "Nothing but the table of the cells whose words contain this, as \"tiles, 5000 Hz\" does")
      ->excludes(plots);
  app->add_flag("--first-strokes", options->is_first_strokes, "Nothing but the tiles that first strokes receive")
      ->excludes(plots);
  app->add_option("--contact", options->contact,
                  "How contacts push in the closed loop: as springs, or as constraints; replays have no tool")
      ->check(CLI::IsMember({"penalty", "constraint"}))
      ->capture_default_str();
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
