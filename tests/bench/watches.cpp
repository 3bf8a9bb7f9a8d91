// How often the guard's watches tell a sound device off, and how soon they tell a wrong one: simulated hands by
// thousands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/on_all_cores.h"
#include "tests/bench/watched_hand.h"

namespace farfeel::bench {
namespace {

constexpr double kToldWithin_s = 0.1, kMostGiven_J = 0.1, kLeastTold = 0.95;
constexpr std::size_t kMostShown = 10;

struct Options {
  std::size_t touches = 10'000, outages = 2'000, wirings = 2'000;
  std::uint64_t seed = 1;
  bool shows_json = false;
};

std::vector<WatchedOutcome> outcomes_of(const WatchedCase& like, std::size_t count, std::uint64_t seed) {
  std::vector<WatchedOutcome> outcomes(count);
  on_all_cores(count, [&](std::size_t i) {
    WatchedCase one = like;
    one.seed = seed + i;
    outcomes[i] = watch(one);
  });
  return outcomes;
}

/// Sound devices: an alarm is a false one.
nlohmann::ordered_json sound_row(const char* name, const WatchedCase& like, std::size_t count, std::uint64_t seed,
                                 std::size_t& alarms) {
  const std::vector<WatchedOutcome> outcomes = outcomes_of(like, count, seed);
  std::size_t false_alarms = 0, touched = 0, not_back = 0;
  double tried_s = 0;
  for (const WatchedOutcome& outcome : outcomes) {
    touched += outcome.is_touched ? 1 : 0;
    not_back += outcome.is_back ? 0 : 1;
    tried_s += outcome.tried_s / static_cast<double>(count);
    if (outcome.alarm.empty()) continue;
    if (++false_alarms <= kMostShown) fmt::print("  false alarm, {}: {}\n", outcome.alarm, outcome.what);
  }
  alarms += false_alarms;
  fmt::print("{:36} {:6} cases, {:6} touched, {:3} false alarms{}\n", name, count, touched, false_alarms,
             like.is_new_device ? fmt::format(", axes tried for {:.2f} s in the mean", tried_s) : std::string());
  std::fflush(stdout);
  return {{"watch", name},   {"cases", count}, {"touched", touched},   {"false_alarms", false_alarms},
          {"wrong_axes", 0}, {"found", 0},     {"not_back", not_back}, {"tried_s", tried_s}};
}

nlohmann::ordered_json wrong_row(std::size_t count, std::uint64_t seed, bool& is_good) {
  const std::vector<WatchedOutcome> outcomes = outcomes_of({.is_new_device = true, .is_miswired = true}, count, seed);
  std::size_t found = 0, withheld = 0, shown = 0;
  double most_J = 0;
  for (const WatchedOutcome& outcome : outcomes) {
    const bool is_found = !outcome.alarm.empty() && outcome.told_s <= kToldWithin_s;
    found += is_found ? 1 : 0;
    if (is_found) continue;
    most_J = std::max(most_J, outcome.given_J);
    withheld += outcome.is_touched ? 0 : 1;
    if (++shown <= kMostShown)
      fmt::print("  {}, {:.3f} J given: {}\n",
                 !outcome.alarm.empty() ? "told late"
                 : outcome.is_touched   ? "not told"
                                        : "withheld",
                 outcome.given_J, outcome.what);
  }
  const double share = count > 0 ? static_cast<double>(found) / static_cast<double>(count) : 1;
  is_good = share >= kLeastTold && most_J <= kMostGiven_J;
  fmt::print(
      "wrong signs and swapped axes: {} of {} told by {:.0f} ms after the touch; to {} more no force came, since "
      "their hands moved too much; of all that were not told a hand got {:.3f} J at most\n",
      found, count, 1e3 * kToldWithin_s, withheld, most_J);
  return {{"watch", "wrong axes, new device"},
          {"cases", count},
          {"false_alarms", 0},
          {"wrong_axes", count},
          {"found", found},
          {"withheld", withheld},
          {"untold_most_J", most_J}};
}

int measure(const Options& options) {
  nlohmann::ordered_json rows;
  std::size_t alarms = 0;
  const auto sound = [&](const char* name, const WatchedCase& like, std::size_t count, std::uint64_t block) {
    rows.push_back(sound_row(name, like, count, options.seed + 1'000'000 * block, alarms));
  };
  sound("first touches, new device", {.is_new_device = true}, options.touches / 2, 1);
  sound("first touches, known device", {}, options.touches - options.touches / 2, 2);
  const std::size_t third = options.outages / 3;
  sound("a link that stalls", {.disturbance = Disturbance::kLinkOutage}, options.outages - 2 * third, 3);
  sound("a machine that freezes", {.disturbance = Disturbance::kMachineFreeze}, third, 4);
  sound("an object that moves", {.disturbance = Disturbance::kObjectMoves}, third, 5);
  bool is_good = true;
  rows.push_back(wrong_row(options.wirings, options.seed + 6'000'000, is_good));
  if (options.shows_json) fmt::print("{}\n", nlohmann::ordered_json{{"rows", rows}}.dump());
  return alarms == 0 && is_good ? 0 : 1;
}

}  // namespace

void add_watches(CLI::App& bench) {
  static Options options;
  CLI::App* command = bench.add_subcommand(
      "watches", "False alarms of the device's guard, and wrong axes that it finds, in simulated hands (2 min)");
  command->add_option("--touches", options.touches, "first touches with sound devices")->capture_default_str();
  command->add_option("--outages", options.outages, "links that stall, machines that freeze, objects that move")
      ->capture_default_str();
  command->add_option("--wirings", options.wirings, "new devices with wrong signs or swapped axes")
      ->capture_default_str();
  command->add_option("--seed", options.seed, "of the first case")->capture_default_str();
  command->add_flag("--json", options.shows_json, "one JSON object as the last line");
  command->callback([] {
    if (const int code = measure(options); code != 0) throw CLI::RuntimeError(code);
  });
}

}  // namespace farfeel::bench
