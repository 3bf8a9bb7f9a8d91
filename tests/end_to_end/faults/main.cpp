// farfeel-faults: whether a session lives through what networks, machines and strangers do to it. It runs seeded
// schedules of faults between two processes over real sockets, and a flood of junk handshakes; or packets without end
// in simulated time. The last line is JSON; the exit code is 0 only without violations.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/faults/drill.h"
#include "tests/end_to_end/faults/flood.h"
#include "tests/end_to_end/faults/outages.h"
#include "tests/end_to_end/faults/remote_world.h"
#include "tests/end_to_end/faults/simulated.h"

namespace farfeel::end_to_end {
namespace {

struct RunOptions {
  std::uint64_t seed = 1;
  int schedules = 1;
  double hours = 0;  ///< 0: as many schedules as said; else as many as fit
  int flood_blocks = 40;
  double flood_per_s = 100'000;
  bool lets_keys_die = false;
};

constexpr double kMostFloodRatio = 2;

class Run {
 public:
  Run(std::string program, const RunOptions& options) : program_(std::move(program)), options_(options) {}

  int all() {
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::duration<double, std::ratio<3600>>(options_.hours);
    const auto goes_on = [&] {
      return options_.hours > 0 ? std::chrono::steady_clock::now() < until : schedules_ < options_.schedules;
    };
    while (goes_on()) schedule(options_.seed + static_cast<std::uint64_t>(schedules_));
    if (options_.flood_blocks > 0) flood();
    nlohmann::ordered_json line;
    line["schedules"] = schedules_;
    line["violations"] = violations_;
    line["worst_recovery_ms"] = worst_.recovery_ms;
    line["flood_p99_ratio"] = options_.flood_blocks > 0 ? nlohmann::ordered_json(flood_.ratio()) : nullptr;
    line["worst_recovery_of"] = std::string(name(worst_.kind));
    line["worst_migration_beyond_round_trip_ms"] = worst_migration_ms_;
    line["shaken_steps"] = shaken_steps_;
    line["largest_force_step_N"] = largest_step_N_;
    line["answers"] = answers_;
    line["tiles"] = tiles_;
    if (options_.flood_blocks > 0)
      line["flood"] = {{"p99_us", flood_.p99_us},   {"p99_elsewhere_us", flood_.p99_elsewhere_us},
                       {"p50_us", flood_.p50_us},   {"p50_elsewhere_us", flood_.p50_elsewhere_us},
                       {"per_s", flood_.per_s},     {"per_s_elsewhere", flood_.per_s_elsewhere},
                       {"answers", flood_.answers}, {"shaken", flood_.shaken}};
    line["seed"] = options_.seed;
    fmt::print("{}\n", line.dump());
    return violations_ == 0 ? 0 : 1;
  }

 private:
  void schedule(std::uint64_t seed) {
    fmt::print("schedule of seed {}\n", seed);
    try {
      Drill drill(program_, seed);
      const auto tell = [&](const FaultOutcome& o) { told(drill, o, seed); };
      (void)drill.run(tell);
      if (options_.lets_keys_die && schedules_ % 10 == 0) tell(drill.let_keys_die());
      for (const std::string& word : drill.watch().take_words()) violated(word, seed);
      violations_ = violations_before_ + drill.watch().violations();
      largest_step_N_ = std::max(largest_step_N_, drill.watch().largest_step_N.load());
      shaken_steps_ += drill.shaken_steps();
      answers_ += drill.watch().answers, tiles_ += drill.watch().tiles;
    } catch (const std::exception& e) {
      ++violations_;
      violated(e.what(), seed);
    }
    violations_before_ = violations_;
    ++schedules_;
  }

  void told(Drill& drill, const FaultOutcome& o, std::uint64_t seed) {
    fmt::print("  {:18} round trip {:4.0f} ms, back after {:7.1f} ms{}\n", name(o.kind), o.round_trip_ms, o.recovery_ms,
               o.most_ms > 0
                   ? fmt::format(" (at most {:.0f}, and {:.1f} of this machine's lateness)", o.most_ms, o.allowance_ms)
                   : std::string());
    if (o.recovery_ms > worst_.recovery_ms) worst_ = o;
    if (o.most_ms > 0 && o.kind != FaultKind::kRestart && o.kind != FaultKind::kOtherScene)
      worst_migration_ms_ = std::max(worst_migration_ms_, o.recovery_ms - o.round_trip_ms);
    for (const std::string& word : drill.watch().take_words()) violated(word, seed);
    std::fflush(stdout);
  }

  static void violated(const std::string& what, std::uint64_t seed) {
    fmt::print("  VIOLATION {}\n  again with: farfeel-faults run --seed {} --flood-blocks 0\n", what, seed);
  }

  void flood() {
    flood_ = measure_flood(program_, options_.flood_blocks, options_.flood_per_s);
    fmt::print(
        "flood: {:.0f}/s at the slave's port, round trip p50 {:.0f} us, p99 {:.0f} us; {:.0f}/s at another's, p50 "
        "{:.0f} us, p99 {:.0f} us\n",
        flood_.per_s, flood_.p50_us, flood_.p99_us, flood_.per_s_elsewhere, flood_.p50_elsewhere_us,
        flood_.p99_elsewhere_us);
    if (flood_.ratio() < kMostFloodRatio) return;
    ++violations_;
    fmt::print("  VIOLATION under the flood the session's p99 is {:.2f} times as long\n", flood_.ratio());
  }

  std::string program_;
  RunOptions options_;
  int schedules_ = 0;
  std::uint64_t violations_ = 0, violations_before_ = 0, answers_ = 0, tiles_ = 0, shaken_steps_ = 0;
  FaultOutcome worst_;
  double worst_migration_ms_ = 0, largest_step_N_ = 0;
  FloodResult flood_;
};

/// Packets through one lane, and a tenth as many through whole sessions.
int simulate(std::uint64_t packets, std::uint64_t seed) {
  const auto told = [&](const char* what, const SimulatedResult& r) {
    fmt::print(
        "{}: {} packets in {:.0f} s of simulated time, {} of them believed, {} handshakes, {} times no counter was "
        "left\n",
        what, r.packets, r.simulated_s, r.opened, r.handshakes, r.refusals);
    for (const std::string& word : r.violations) fmt::print("  VIOLATION {}\n", word);
    std::fflush(stdout);
    return r;
  };
  const SimulatedResult lane = told("a lane", carry(packets, seed)),
                        session = told("sessions", live(packets / 10, seed));
  const std::size_t violations = lane.violations.size() + session.violations.size();
  const nlohmann::ordered_json line{{"packets", lane.packets + session.packets},
                                    {"violations", violations},
                                    {"refusals", lane.refusals + session.refusals},
                                    {"handshakes", lane.handshakes + session.handshakes},
                                    {"simulated_s", lane.simulated_s + session.simulated_s},
                                    {"seed", seed}};
  fmt::print("{}\n", line.dump());
  return violations == 0 ? 0 : 1;
}

/// Outages of the link, in simulated time.
int outages(std::size_t count, std::uint64_t seed) {
  constexpr std::size_t kMostShown = 20;
  const OutagesResult result = survive_outages(count, seed);
  for (std::size_t i = 0; i < std::min(kMostShown, result.words.size()); ++i)
    fmt::print("  VIOLATION {}\n", result.words[i]);
  const nlohmann::ordered_json line{
      {"outages", result.outages},   {"played_old", result.played_old},   {"step_N_per_s_max", result.step_N_per_s_max},
      {"not_back", result.not_back}, {"violations", result.words.size()}, {"seed", seed}};
  fmt::print("{}\n", line.dump());
  return result.words.empty() ? 0 : 1;
}

}  // namespace
}  // namespace farfeel::end_to_end

int main(int argc, char** argv) {
  using namespace farfeel::end_to_end;
  CLI::App app{"Faults of networks, machines and strangers, and what a session makes of them."};
  app.require_subcommand(1);
  RunOptions options;
  CLI::App* run = app.add_subcommand("run", "seeded schedules of faults between two processes, then a flood");
  run->add_option("--seed", options.seed, "of the first schedule; the next has the next");
  run->add_option("--schedules", options.schedules, "how many, of some 40 s each");
  run->add_option("--hours", options.hours, "as many schedules as fit in so long");
  run->add_option("--flood-blocks", options.flood_blocks, "of either place, a quarter of a second each; 0: no flood");
  run->add_option("--flood-rate", options.flood_per_s, "junk handshakes a second");
  run->add_flag("--let-keys-die", options.lets_keys_die, "every tenth schedule ends in a silence of 181 s");
  std::uint64_t packets = 100'000'000;
  CLI::App* simulated =
      app.add_subcommand("simulate", "packets through lanes near their last counter, in simulated time");
  simulated->add_option("--packets", packets, "through one lane; a tenth as many go through sessions");
  simulated->add_option("--seed", options.seed);
  std::size_t outage_count = 1000;
  CLI::App* outage = app.add_subcommand("outages", "outages of the link under a hand that presses, in simulated time");
  outage->add_option("--count", outage_count, "how many, of 20 ms to 5 s");
  outage->add_option("--seed", options.seed, "of the first; the next has the next");
  SlaveStart start;
  int tell = -1;
  double per_s = 0;
  bool no_edits = false;
  CLI::App* slave = app.add_subcommand("slave", "the other process")->group("");
  slave->add_option("--port", start.port);
  slave->add_option("--run", start.run);
  slave->add_option("--scene", start.scene);
  slave->add_flag("--no-edits", no_edits);
  slave->add_option("--tell", tell)->required();
  CLI::App* flood = app.add_subcommand("flood", "the stranger")->group("");
  flood->add_option("--port", start.port)->required();
  std::uint16_t elsewhere = 0;
  flood->add_option("--elsewhere", elsewhere)->required();
  flood->add_option("--rate", per_s)->required();
  flood->add_option("--tell", tell)->required();
  CLI11_PARSE(app, argc, argv);
  start.edits = !no_edits;
  if (slave->parsed()) serve(start, tell);
  if (flood->parsed()) pour(start.port, elsewhere, per_s, tell);
  if (simulated->parsed()) return simulate(packets, options.seed);
  if (outage->parsed()) return outages(outage_count, options.seed);
  return Run("/proc/self/exe", options).all();
}
