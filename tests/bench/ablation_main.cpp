// farfeel-bench ablation: each mechanism is left out, one at a time, over the hard cases that it names and some at
// random. A row is lost when it passes with the mechanism and fails without. Times and forces are taken in the scene
// that it names, with and without in turn; ratios are without / with.
//
// farfeel-bench ablation --without NAME[,NAME...] COMMAND ...: any other measurement, with these left out together.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/settings/command_line.h"
#include "haptic_core/ablation/ablation.h"
#include "tests/bench/ablation_cases.h"
#include "tests/bench/ablation_rows.h"
#include "tests/bench/ablation_speed.h"
#include "tests/bench/bench.h"

namespace farfeel::bench {
namespace {

constexpr int kRounds = 5;
constexpr std::size_t kRandomContact = 3,
                      kRandomLoop = 11;             ///< cases of some three rows each, and rows: 20 rows in all
constexpr double kNoForce = 1e-3, kNoShare = 0.01;  ///< errors that are as good as none

struct Options {
  bool is_json = false, is_full = false, is_quick = false;
  std::vector<std::string> mechanisms;
  std::uint32_t seed = 1;
};

struct Chosen {
  std::set<std::size_t> contact, loop;
};

struct Outcome {
  std::size_t rows = 0;
  std::vector<std::string> lost, won;
  double p50_ratio = 0, p99_ratio = 0, force_err_ratio = 0, p50_us = 0;
};

class LeftOut {
 public:
  explicit LeftOut(Mechanism mechanism) : place_(static_cast<std::size_t>(mechanism)) {
    ablation::left_out[place_] = true;
  }
  ~LeftOut() { ablation::left_out[place_] = false; }
  LeftOut(const LeftOut&) = delete;
  LeftOut& operator=(const LeftOut&) = delete;

 private:
  std::size_t place_;
};

const ablation::Named& named(Mechanism mechanism) {
  return ablation::kMechanisms[static_cast<std::size_t>(mechanism)];
}

/// The rows that a case names, as many as it wants of each kind, spread over all that there are.
std::set<std::size_t> picked(const AblationRows& rows, const LoopPick& pick) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < rows.loop().size(); ++i) {
    const LoopCaseRow& row = rows.loop()[i];
    if (row.name.find(pick.only) != std::string::npos && (pick.rung.empty() || row.rung == pick.rung) &&
        (!pick.is_far || row.link.round_trip_ns > 0))
      all.push_back(i);
  }
  if (all.empty()) throw std::logic_error(fmt::format("no row of the loop is called {}", pick.only));
  std::set<std::size_t> some;
  const std::size_t most = std::min<std::size_t>(pick.most, all.size());
  for (std::size_t k = 0; k < most; ++k) some.insert(all[(2 * k + 1) * all.size() / (2 * most)]);
  return some;
}

Chosen chosen_for(const AblationCase& tried, const AblationRows& rows, const Options& options) {
  Chosen chosen;
  const auto add_case = [&](std::string_view name) {
    const auto at = std::find_if(rows.contact().begin(), rows.contact().end(),
                                 [name](const HardCase& one) { return one.name == name; });
    if (at == rows.contact().end()) throw std::logic_error(fmt::format("no hard case is called {}", name));
    chosen.contact.insert(static_cast<std::size_t>(at - rows.contact().begin()));
  };
  if (options.is_quick) {
    add_case("flat on flat, tilted");
    add_case("opposed walls");
    return chosen;
  }
  if (options.is_full) {
    for (std::size_t i = 0; i < rows.contact().size(); ++i) chosen.contact.insert(i);
    for (std::size_t i = 0; i < rows.loop().size(); ++i) chosen.loop.insert(i);
    return chosen;
  }
  for (const std::string_view name : tried.contact) add_case(name);
  for (const LoopPick& pick : tried.loop) chosen.loop.merge(picked(rows, pick));
  std::mt19937 random(options.seed);
  for (std::size_t i = 0; i < kRandomContact; ++i) chosen.contact.insert(random() % rows.contact().size());
  for (std::size_t i = 0; i < kRandomLoop; ++i) chosen.loop.insert(random() % rows.loop().size());
  return chosen;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void take_times(const AblationCase& tried, const AblationScenes& scenes, bool is_quick, Outcome& outcome) {
  std::vector<double> p50_us[2], p99_us[2];
  for (int round = 0; round < (is_quick ? 1 : kRounds); ++round) {
    for (const int turn : {0, 1}) {
      const int is_without = (turn + round) % 2;
      SceneTimes times;
      if (is_without != 0) {
        const LeftOut out(tried.mechanism);
        times = scenes.walk(tried.scene, is_quick);
      } else {
        times = scenes.walk(tried.scene, is_quick);
      }
      p50_us[is_without].push_back(times.p50_us), p99_us[is_without].push_back(times.p99_us);
    }
  }
  outcome.p50_us = median(p50_us[0]);
  outcome.p50_ratio = median(p50_us[1]) / outcome.p50_us;
  outcome.p99_ratio = median(p99_us[1]) / median(p99_us[0]);
}

double force_off(const std::vector<JudgedRow>& rows) {
  double sum = 0;
  for (const JudgedRow& row : rows) sum += row.force_off;
  return sum / std::max<double>(1, static_cast<double>(rows.size()));
}

Outcome outcome_of(const AblationCase& tried, const Chosen& chosen, const AblationRows& rows,
                   const AblationScenes& scenes, const std::map<std::string, JudgedRow>& with, bool is_quick) {
  Outcome outcome;
  take_times(tried, scenes, is_quick, outcome);
  const std::optional<double> wrench_with = is_quick ? std::nullopt : scenes.wrench_off(tried.scene);
  const LeftOut out(tried.mechanism);
  std::vector<JudgedRow> same_with;
  const std::vector<JudgedRow> without = rows.judge(chosen.contact, chosen.loop);
  for (const JudgedRow& row : without) {
    const JudgedRow& before = with.at(row.name);
    same_with.push_back(before);
    if (before.passes && !row.passes) outcome.lost.push_back(row.name);
    if (!before.passes && row.passes) outcome.won.push_back(row.name);
  }
  outcome.rows = without.size();
  outcome.force_err_ratio = wrench_with
                                ? (scenes.wrench_off(tried.scene).value() + kNoForce) / (*wrench_with + kNoForce)
                                : (force_off(without) + kNoShare) / (force_off(same_with) + kNoShare);
  return outcome;
}

nlohmann::json told(const AblationCase& tried, const Chosen& chosen, const AblationRows& rows, const Outcome& outcome) {
  std::set<std::string> cases;
  for (const std::size_t i : chosen.contact) cases.emplace(rows.contact()[i].name);
  for (const std::size_t i : chosen.loop) cases.insert(rows.loop()[i].name);
  return {{"mechanism", named(tried.mechanism).name},
          {"source", named(tried.mechanism).source},
          {"cases", cases},
          {"rows", outcome.rows},
          {"rows_lost", outcome.lost.size()},
          {"lost", outcome.lost},
          {"won", outcome.won},
          {"p50_us", outcome.p50_us},
          {"p50_ratio", outcome.p50_ratio},
          {"p99_ratio", outcome.p99_ratio},
          {"force_err_ratio", outcome.force_err_ratio}};
}

/// Leaves out the mechanisms of a list for good. Throws where one is unknown.
void leave_out(std::string_view list) {
  while (!list.empty()) {
    const std::string_view name = list.substr(0, list.find(','));
    list.remove_prefix(std::min(list.size(), name.size() + 1));
    const auto at = std::find_if(ablation::kMechanisms.begin(), ablation::kMechanisms.end(),
                                 [name](const ablation::Named& one) { return one.name == name; });
    if (at == ablation::kMechanisms.end()) throw std::invalid_argument(fmt::format("no mechanism is called {}", name));
    ablation::left_out[static_cast<std::size_t>(at->mechanism)] = true;
  }
}

void run(const Options& options) {
  std::vector<const AblationCase*> all;
  for (const AblationCase& one : ablation_cases()) {
    const auto& names = options.mechanisms;
    if (names.empty() || std::find(names.begin(), names.end(), named(one.mechanism).name) != names.end())
      all.push_back(&one);
  }
  const AblationRows rows;
  AblationScenes scenes;
  Chosen any;
  std::vector<Chosen> chosen;
  for (const AblationCase* one : all) {
    chosen.push_back(chosen_for(*one, rows, options));
    any.contact.insert(chosen.back().contact.begin(), chosen.back().contact.end());
    any.loop.insert(chosen.back().loop.begin(), chosen.back().loop.end());
  }
  if (!options.is_quick) scenes.look_up_truth();
  std::map<std::string, JudgedRow> with;
  for (JudgedRow& row : rows.judge(any.contact, any.loop)) with.emplace(row.name, row);
  nlohmann::json out = nlohmann::json::array();
  fmt::print("{:20} {:>5} {:>5} {:>5} {:>9} {:>7} {:>7} {:>7}\n", "without", "rows", "lost", "won", "with us", "p50 x",
             "p99 x", "force x");
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Outcome outcome = outcome_of(*all[i], chosen[i], rows, scenes, with, options.is_quick);
    fmt::print("{:20} {:>5} {:>5} {:>5} {:9.1f} {:7.3f} {:7.3f} {:7.2f}\n", named(all[i]->mechanism).name, outcome.rows,
               outcome.lost.size(), outcome.won.size(), outcome.p50_us, outcome.p50_ratio, outcome.p99_ratio,
               outcome.force_err_ratio);
    for (const std::string& name : outcome.lost) fmt::print("    lost: {}\n", name);
    std::fflush(stdout);
    out.push_back(told(*all[i], chosen[i], rows, outcome));
  }
  if (options.is_json) fmt::print("{}\n", nlohmann::json{{"rows", out}}.dump());
}

}  // namespace
}  // namespace farfeel::bench

int main(int argc, char** argv) {
  using namespace farfeel;
  if (argc > 2 && std::string_view(argv[1]) == "--without") try {
      bench::leave_out(argv[2]);
      argv[2] = argv[0];
      return bench::run_command(argc - 2, argv + 2);
    } catch (const std::invalid_argument& error) {
      fmt::print(stderr, "farfeel-bench ablation: {}; --help lists all\n", error.what());
      return 2;
    }
  CLI::App app("What fails, and what it costs, without each mechanism of the way from near pieces to a felt force",
               "farfeel-bench ablation");
  bench::Options options;
  app.add_flag("--json", options.is_json, "One JSON object as the last line");
  auto* const full = app.add_flag("--full", options.is_full, "Every row of hardcases contact and loop: hours");
  app.add_flag("--quick", options.is_quick, "Two cases and one round each: that it works, not what it says")
      ->excludes(full);
  std::vector<std::string> names;
  for (const ablation::Named& one : ablation::kMechanisms) names.emplace_back(one.name);
  app.add_option("--mechanisms", options.mechanisms, "Only these, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app.add_option("--seed", options.seed, "Of the rows at random")->capture_default_str();
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  app.footer(
      "farfeel-bench ablation --without NAME[,NAME...] COMMAND ... runs any other measurement with these left out "
      "together.\nThe mechanisms: " +
      all + ".");
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;
  bench::run(options);
}
