// How stiff a wall may be before it is no longer calm, by method, tool mass, grip, rate and round trip.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/teleoperation.h"

namespace farfeel::bench {
namespace {

constexpr double kSoftest_N_per_m = 50;
constexpr int kSteps = 18;  // to 50 * 2^(17/2) = 18 kN/m

double wall_N_per_m(int step) {
  return kSoftest_N_per_m * std::exp2(0.5 * step);
}

/// The press at the stiffest wall that is stable, by bisection: a method that is calm at one wall is taken to be calm
/// at softer ones. Nothing stable: displayed stiffness 0.
Press stiffest(Setting setting) {
  const auto at = [&](int step) {
    setting.wall_N_per_m = wall_N_per_m(step);
    return press(setting);
  };
  Press best = at(kSteps - 1);
  if (best.is_stable) return best;
  int good = -1, bad = kSteps - 1;
  best = {};
  while (bad - good > 1) {
    const int middle = (good + bad) / 2;
    const Press tried = at(middle);
    if (tried.is_stable) {
      good = middle;
      best = tried;
    } else {
      bad = middle;
    }
  }
  return best;
}

void run(bool is_json, bool is_quick) {
  using master_station::Grip;
  const std::vector<double> masses = is_quick ? std::vector<double>{0.01} : std::vector<double>{0.001, 0.01, 0.1};
  const std::vector<double> rates = is_quick ? std::vector<double>{1000} : std::vector<double>{1000, 4000};
  const std::vector<Grip> grips =
      is_quick ? std::vector<Grip>{master_station::kMediumGrip}
               : std::vector<Grip>{master_station::kSoftGrip, master_station::kMediumGrip, master_station::kHardGrip};
  nlohmann::json rows = nlohmann::json::array();
  fmt::print("{:22} {:>6} {:>7} {:>6} {:>6} {:>16} {:>14}\n", "method", "mass g", "grip", "Hz", "rtt ms",
             "displayed N/m", "device min J");
  for (Method method : {Method::kOurs, Method::kHeldWrench, Method::kDirect, Method::kWave, Method::kTimeDomain}) {
    const bool has_tool = method == Method::kOurs || method == Method::kHeldWrench || method == Method::kWave;
    for (double mass_kg : has_tool ? masses : std::vector<double>{0.01}) {
      for (const Grip& grip : grips) {
        for (double tick_hz : rates) {
          for (double round_trip_s : {0.0, 0.01, 0.05, 0.1, 0.2}) {
            const Press best = stiffest({method, grip, mass_kg, tick_hz, round_trip_s, 0});
            fmt::print("{:22} {:6.0f} {:>7} {:6.0f} {:6.0f} {:16.0f} {:14.2e}\n", name(method),
                       has_tool ? 1e3 * mass_kg : NAN, grip.name, tick_hz, 1e3 * round_trip_s, best.displayed_N_per_m,
                       best.device_min_J);
            rows.push_back({{"method", name(method)},
                            {"mass_kg", has_tool ? nlohmann::json(mass_kg) : nlohmann::json()},
                            {"grip", grip.name},
                            {"tick_hz", tick_hz},
                            {"rtt_ms", 1e3 * round_trip_s},
                            {"max_stable_N_per_m", best.displayed_N_per_m},
                            {"device_min_J", best.device_min_J}});
          }
        }
      }
    }
  }
  if (is_json) fmt::print("{}\n", nlohmann::json{{"rows", rows}}.dump());
}

}  // namespace

void add_stability(CLI::App& bench) {
  struct Options {
    bool is_json = false, is_quick = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = bench.add_subcommand(
      "stability", "Largest stiffness displayed at the hand that stays calm, for ours and four other methods");
  command->add_flag("--json", options->is_json, "One JSON object as the last line");
  command->add_flag("--quick", options->is_quick, "One mass, grip and rate only");
  command->callback([options] { run(options->is_json, options->is_quick); });
}

}  // namespace farfeel::bench
