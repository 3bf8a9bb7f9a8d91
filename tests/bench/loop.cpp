// The haptic loop across a link: how true each rung of the local model is to the surface, what it costs in bytes, and
// whether it is calm.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/bench/bench.h"
#include "tests/bench/loop_sweep.h"
#include "tests/bench/loop_tick.h"

namespace farfeel::bench {
namespace {

struct Options {
  bool as_json = false, is_quick = false;
};

void run(const Options& options) {
  const auto scenes = stroked_scenes(options.is_quick ? SceneChoice::kOne : SceneChoice::kAll);
  const LoopSweep swept =
      sweep(scenes, options.is_quick ? quick_grid() : full_grid(), [](std::size_t done, std::size_t all) {
        if (::isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{} of {} cells{}", done, all, done == all ? "\n" : "");
      });
  nlohmann::json rows = nlohmann::json::array();
  fmt::print(
      "{:8} {:>5} {:>6} {:>6} {:>5} {:10} {:>7} {:>7} {:>8} {:>8} {:>7} {:>14} {:>8} {:>7} {:>9} {:>9} {:>9} {:>7}\n",
      "rung", "Hz", "rtt ms", "jitter", "loss", "scene", "force", "torque", "kB/s", "of tiles", "dB", "worst",
      ">100 dB", "step N", "device J", "actuators", "contact J", "stable");
  for (const LoopCell& cell : swept.cells) {
    const Replayed& r = cell.replayed;
    const SpectrumError spectrum = cell.spectrum();
    fmt::print(
        "{:8} {:5.0f} {:6.0f} {:6.0f} {:5.2f} {:10} {:7.3f} {:7.3f} {:8.1f} {:8.1f} {:7.2f} {:6.1f} {:4.0f} Hz {:8.2f} "
        "{:7.3f} {:9.1e} {:9.1e} {:9.1e} {:>7}\n",
        name(cell.rung), cell.tick_hz, cell.rtt_ms, cell.jitter_ms, cell.loss, cell.scene->name(), r.force_share,
        r.torque_share, r.contact_kB_s + r.tile_kB_s, r.tile_kB_s, spectrum.rms_dB, spectrum.worst_dB,
        spectrum.worst_Hz, 10 * std::log10(power_from(cell.closed.contact, 100) / power_from(cell.truth->contact, 100)),
        cell.closed.largest_step_N, cell.closed.device_min_J, cell.closed.actuators_min_J, cell.closed.contact_min_J,
        cell.is_stable() ? "yes" : "no");
    rows.push_back({{"rung", name(cell.rung)},
                    {"tick_hz", cell.tick_hz},
                    {"rtt_ms", cell.rtt_ms},
                    {"jitter_ms", cell.jitter_ms},
                    {"loss", cell.loss},
                    {"scene", cell.scene->name()},
                    {"force_rmse_share", r.force_share},
                    {"torque_rmse_share", r.torque_share},
                    {"spectrum_db", spectrum.rms_dB},
                    {"step_N", cell.closed.largest_step_N},
                    {"device_min_J", cell.closed.device_min_J},
                    {"contact_min_J", cell.closed.contact_min_J},
                    {"kB_s", r.contact_kB_s + r.tile_kB_s},
                    {"stable", cell.is_stable()}});
  }
  const TickTimes seven = time_seven_contacts(options.is_quick ? 2000 : 16000);
  fmt::print("a tick that feels {} contacts, windows of 64 x 64 texels: p50 {:.0f}, p99 {:.0f}, p99.9 {:.0f} us\n",
             seven.contacts, seven.p50_us, seven.p99_us, seven.p99_9_us);
  const nlohmann::json tick_us{
      {"contacts", seven.contacts}, {"p50", seven.p50_us}, {"p99", seven.p99_us}, {"p99_9", seven.p99_9_us}};
  if (options.as_json)
    fmt::print("{}\n", nlohmann::json{{"rows", rows}, {"tick_us", {{"seven_contacts", tick_us}}}}.dump());
}

}  // namespace

void add_loop(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* app =
      bench.add_subcommand("loop", "How true each rung of the local model is, over rates, delays, jitter and loss");
  app->add_flag("--quick", options->is_quick, "Fewer rates, delays and scenes, shorter strokes");
  app->add_flag("--json", options->as_json, "One object as the last line");
  app->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
