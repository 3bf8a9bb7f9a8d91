// How stiff a wall may be before it is no longer calm, by method, tool mass, grip, rate and round trip.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "haptic_core/passivity/energy_tank.h"
#include "tests/bench/bench.h"
#include "tests/bench/device_stability.h"
#include "tests/bench/plot_labels.h"
#include "tests/bench/svg.h"
#include "tests/bench/teleoperation.h"

namespace farfeel::bench {
namespace {

constexpr double kSoftest_N_per_m = 50;
constexpr std::array kMethods{Method::kOurs,   Method::kOursMidpoint, Method::kHeldWrench,
                              Method::kDirect, Method::kWave,         Method::kTimeDomain};
constexpr double kMostDrop = 0.1;
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

/// The least of what is displayed at a delay over what is without, for ours, of all masses, grips and rates.
double least_kept(const nlohmann::json& rows) {
  double least = 1;
  for (const nlohmann::json& row : rows) {
    if (row["method"] != name(Method::kOurs)) continue;
    for (const nlohmann::json& near : rows) {
      if (near["method"] == row["method"] && near["mass_kg"] == row["mass_kg"] && near["grip"] == row["grip"] &&
          near["tick_hz"] == row["tick_hz"] && near["rtt_ms"] == 0 && near["max_stable_N_per_m"] > 0)
        least = std::min(least, row["max_stable_N_per_m"].get<double>() / near["max_stable_N_per_m"].get<double>());
    }
  }
  return least;
}

/// Displayed stiffness against delay, a line a method, means over masses, grips and rates.
void plot(const nlohmann::json& rows, const std::string& path) {
  constexpr std::array kColours{"#3a7d44", "#5aa9a1", "#b0413e", "#3b6ea5", "#8d6a9f", "#c98a1b"};
  const auto x = [](double rtt_ms) { return 80 + 2.1 * rtt_ms; };
  const auto y = [](double N_per_m) { return 340 - 75 * std::clamp(std::log10(std::max(N_per_m, 1.0)), 0.0, 4.0); };
  Svg svg(path, {680, 400});
  svg.words({80, 22}, "largest stable stiffness displayed at the hand [N/m], mean; 1: none");
  svg.words({290, 385}, "round trip [ms]", {.anchor = "middle"});
  for (const double k : {1.0, 10.0, 100.0, 1000.0, 10000.0}) {
    svg.line({80, y(k)}, {500, y(k)});
    svg.words({74, y(k) + 4}, fmt::format("{:g}", k), {.anchor = "end"});
  }
  std::array<double, kMethods.size()> ends_px{};
  double end_px = 0;
  for (std::size_t line = 0; line < kMethods.size(); ++line) {
    const Method method = kMethods[line];
    std::map<double, std::pair<double, int>> at;
    for (const nlohmann::json& row : rows) {
      if (row["method"] != name(method)) continue;
      auto& [sum, count] = at[row["rtt_ms"]];
      sum += row["max_stable_N_per_m"].get<double>(), ++count;
    }
    std::vector<glm::dvec2> points;
    for (const auto& [rtt_ms, sum] : at) {
      end_px = x(rtt_ms), ends_px[line] = y(sum.first / sum.second);
      points.emplace_back(end_px, ends_px[line]);
      if (line == 0) svg.words({end_px, 360}, fmt::format("{:g}", rtt_ms), {.anchor = "middle"});
    }
    svg.curve(points, {.colour = kColours[line], .width_px = 2});
  }
  const auto labels_px = label_heights_px(ends_px);
  for (std::size_t line = 0; line < kMethods.size(); ++line)
    svg.words({end_px + 8, labels_px[line] + 4}, name(kMethods[line]), {.colour = kColours[line]});
}

nlohmann::json json_of(const DeviceRow& row) {
  const bool is_along = row.motion == Motion::kAlong;
  const auto key = [&](const char* figure, const char* along, const char* about) {
    return fmt::format("{}_{}", figure, is_along ? along : about);
  };
  return {{"device", row.device},
          {"motion", is_along ? "along" : "about"},
          {"delay_ms", row.delay_ms},
          {key("damping", "Ns_per_m", "Nms_per_rad"), row.picked.damping},
          {key("auto", "N_per_m", "Nm_per_rad"), row.picked.stiffness},
          {key("stiffest", "N_per_m", "Nm_per_rad"), row.stiffest},
          {"share", row.share()},
          {"is_calm", row.is_calm}};
}

/// Every model of device that is carried: what is picked for it, beside the stiffest that a simulation finds calm.
/// Couplings that data states are told apart: the rule did not pick them.
nlohmann::json device_figures() {
  nlohmann::json picked = nlohmann::json::array(), stated = nlohmann::json::array();
  bool are_good = true;
  fmt::print("{:20} {:>6} {:>9} {:>10} {:>10} {:>10} {:>6} {:>5}\n", "device", "motion", "delay ms", "damping", "auto",
             "stiffest", "share", "calm");
  for (const std::string& name : devices::model_names()) {
    for (const DeviceRow& row : device_rows(*devices::find_model(name))) {
      fmt::print("{:20} {:>6} {:9.2f} {:10.3g} {:10.4g} {:10.4g} {:6.2f} {:>5}{}\n", row.device,
                 row.motion == Motion::kAlong ? "along" : "about", row.delay_ms, row.picked.damping,
                 row.picked.stiffness, row.stiffest, row.share(), row.is_calm ? "yes" : "NO",
                 row.is_stated ? "  stated by its data" : "");
      are_good = are_good && row.is_good();
      (row.is_stated ? stated : picked).push_back(json_of(row));
    }
  }
  fmt::print("{} what is picked is calm in no hand at all, and where the rule picks, at least {:.2f} of the stiffest\n",
             are_good ? "met    " : "NOT MET", DeviceRow::kLeastShare);
  return {{"devices", picked}, {"stated", stated}};
}

void run(bool is_json, bool is_quick, bool is_devices, local_model::ContactLaw contact, const std::string& plots) {
  using master_station::Grip;
  nlohmann::json told = device_figures();
  if (is_devices) {
    if (is_json) fmt::print("{}\n", told.dump());
    return;
  }
  const std::vector<double> masses = is_quick ? std::vector<double>{0.01} : std::vector<double>{0.001, 0.01, 0.1};
  const std::vector<double> rates = is_quick ? std::vector<double>{1000} : std::vector<double>{1000, 4000};
  const std::vector<Grip> grips =
      is_quick ? std::vector<Grip>{master_station::kMediumGrip}
               : std::vector<Grip>{master_station::kSoftGrip, master_station::kMediumGrip, master_station::kHardGrip};
  nlohmann::json rows = nlohmann::json::array();
  double ours_contact_bounds = 0;  // the worst, of its bound; a wall that none is calm at has neither
  fmt::print("{:22} {:>6} {:>7} {:>6} {:>6} {:>16} {:>14} {:>14}\n", "method", "mass g", "grip", "Hz", "rtt ms",
             "displayed N/m", "device min J", "contact min J");
  for (const Method method : kMethods) {
    const bool has_tool = has_model(method) || method == Method::kWave;
    for (double mass_kg : has_tool ? masses : std::vector<double>{0.01}) {
      for (const Grip& grip : grips) {
        for (double tick_hz : rates) {
          for (double round_trip_s : {0.0, 0.01, 0.05, 0.1, 0.2}) {
            const Press best = stiffest({method, grip, mass_kg, tick_hz, round_trip_s, 0, contact});
            fmt::print("{:22} {:>6.0f} {:>7} {:6.0f} {:6.0f} {:16.0f} {:14.2e} {:>14.2e}\n", name(method),
                       has_tool ? 1e3 * mass_kg : NAN, grip.name, tick_hz, 1e3 * round_trip_s, best.displayed_N_per_m,
                       best.device_min_J, has_model(method) ? best.contact_min_J : NAN);
            if (method == Method::kOurs)
              ours_contact_bounds =
                  std::max(ours_contact_bounds, -best.contact_min_J / std::max(best.contact_bound_J, 1e-6));
            rows.push_back(
                {{"method", name(method)},
                 {"mass_kg", has_tool ? nlohmann::json(mass_kg) : nlohmann::json()},
                 {"grip", grip.name},
                 {"tick_hz", tick_hz},
                 {"rtt_ms", 1e3 * round_trip_s},
                 {"contact", contact == local_model::ContactLaw::kConstraint ? "constraint" : "penalty"},
                 {"max_stable_N_per_m", best.displayed_N_per_m},
                 {"device_min_J", best.device_min_J},
                 {"contact_min_J", has_model(method) ? nlohmann::json(best.contact_min_J) : nlohmann::json()}});
          }
        }
      }
    }
  }
  const double kept = least_kept(rows);
  double ours_min_J = 0;
  for (const nlohmann::json& row : rows)
    if (row["method"] == name(Method::kOurs)) ours_min_J = std::min(ours_min_J, row["device_min_J"].get<double>());
  const double tank_J = passivity::TankSettings{}.cap_J;
  fmt::print("{} ours keeps at least {:.0f} % of its stiffness from 0 to 200 ms (goal {:.0f} %)\n",
             kept >= 1 - kMostDrop ? "met    " : "NOT MET", 100 * kept, 100 * (1 - kMostDrop));
  fmt::print("{} ours gave the hand at most {:.2g} J more than it got (goal: the tank's {:g} J)\n",
             ours_min_J >= -tank_J ? "met    " : "NOT MET", -std::min(0.0, ours_min_J) + 0.0, tank_J);
  fmt::print("{} ours gave out at most {:.2g} of the contact port's bound (goal: 1)\n",
             ours_contact_bounds <= 1 ? "met    " : "NOT MET", ours_contact_bounds);
  if (!plots.empty()) plot(rows, plots + "/stability.svg");
  told["rows"] = rows;
  if (is_json) fmt::print("{}\n", told.dump());
}

}  // namespace

void add_stability(CLI::App& bench) {
  struct Options {
    bool is_json = false, is_quick = false, is_devices = false;
    std::string plots, contact = "penalty";
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = bench.add_subcommand(
      "stability",
      "Largest stiffness displayed at the hand that stays calm, for ours by both integrators and four other methods");
  command->add_flag("--json", options->is_json, "One JSON object as the last line");
  CLI::Option* quick = command->add_flag("--quick", options->is_quick, "One mass, grip and rate only");
  command->add_flag("--devices", options->is_devices, "Only how stiff each model of device renders calmly")
      ->excludes(quick);
  command->add_option("--plots", options->plots, "Folder for stability.svg")
      ->check(CLI::ExistingDirectory)
      ->excludes(quick);
  command->add_option("--contact", options->contact, "How contacts push in ours: as springs, or as constraints")
      ->check(CLI::IsMember({"penalty", "constraint"}))
      ->capture_default_str();
  command->callback([options] {
    run(options->is_json, options->is_quick, options->is_devices,
        local_model::find_contact_law(options->contact).value(), options->plots);
  });
}

}  // namespace farfeel::bench
