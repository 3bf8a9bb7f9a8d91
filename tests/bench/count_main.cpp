// farfeel-bench count: how much work is done along frozen motions. Built from sources that count it; see
// haptic_core/counting/work.h.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "codecs/settings/command_line.h"
#include "deploy/replay/session_replay.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/bench/counted_inputs.h"
#include "tests/bench/counted_motions.h"
#include "tests/bench/work_history.h"

namespace farfeel::bench {
namespace {

constexpr int kSkipped = 3;

struct Options {
  std::string inputs = "tests/counted", kernels = "avx2", only, check, record, commit, why, freeze, history;
  bool is_json = false;
};

void print(const std::vector<CountedRow>& rows) {
  for (const CountedRow& row : rows) {
    fmt::print("{}\n", row.name);
    for (const auto& [counter, count] : row.counts) fmt::print("  {:16} {:>12}\n", counter, count);
  }
}

/// Each count through the file's entries, and against the first.
void print_history(const WorkHistory& history) {
  std::size_t number = 0;
  for (const nlohmann::json& entry : history.entries()) {
    fmt::print("{}: {} of {}: {}\n", ++number, entry.value("commit", ""), entry.value("date", ""),
               entry.value("why", ""));
    if (entry.contains("lacking")) fmt::print("   {}\n", entry["lacking"].get<std::string>());
  }
  for (const auto& [row, counts] : history.entries().back()["counts"].items()) {
    fmt::print("{}\n", row);
    for (const auto& [counter, newest] : counts.items()) {
      std::string line;
      std::optional<double> first;
      for (const nlohmann::json& entry : history.entries()) {
        const nlohmann::json count =
            entry["counts"].value(row, nlohmann::json::object()).value(counter, nlohmann::json());
        line += count.is_null() ? fmt::format("{:>12}", "-") : fmt::format("{:>12}", count.get<std::uint64_t>());
        if (!first && count.is_number() && count > 0) first = count.get<double>();
      }
      fmt::print("  {:16}{}  x {:.2f}\n", counter, line, newest.get<double>() / first.value_or(newest.get<double>()));
    }
  }
}

/// Returns the exit code.
int checked(const Options& options, const std::vector<CountedRow>& rows) {
  const WorkHistory history{options.check};
  const std::vector<WorkDifference> differences = history.differences(rows);
  if (differences.empty()) return 0;
  bool is_more = false;
  for (const WorkDifference& d : differences) {
    is_more = is_more || d.now > d.before;
    fmt::print(stderr, "{:22} {:16} was {:>12}, is {:>12}: x {:.3f}\n", d.row, d.counter, d.before, d.now,
               d.before > 0 ? static_cast<double>(d.now) / static_cast<double>(d.before) : 0.0);
  }
  fmt::print(stderr,
             "{} counts are off those in {} by more than {:.0f} %. {}\n"
             "Then record them in the same commit, from the repository's root:\n"
             "  farfeel-bench count --record {} --commit \"after $(git rev-parse --short HEAD)\" --why \"...\"\n",
             differences.size(), options.check, 100 * kSameWork,
             is_more ? "Where one grew, find out why: if it has to, the commit's message says so."
                     : "Less work: good, as long as nothing else is worse.",
             options.check);
  return 1;
}

int run(const Options& options) {
  if (!options.history.empty()) return print_history(WorkHistory{options.history}), 0;
  if (!options.freeze.empty()) return CountedInputs::freeze(options.freeze), 0;
  if (options.kernels == "plain") penetration::hold_best_to(penetration::InstructionSet::kPlain);
  if (options.kernels == "avx2") {
    if (const auto held = replay::hold_to_avx2(); !held) {
      fmt::print("skipped: {}\n", held.error());
      return kSkipped;
    }
  }
  const std::vector<CountedRow> rows = counted_rows(CountedInputs(options.inputs), options.only);
  print(rows);
  if (!options.record.empty()) add_to_history(options.record, options.commit, options.why, rows);
  const int code = options.check.empty() ? 0 : checked(options, rows);
  if (options.is_json)
    fmt::print("{}\n", nlohmann::ordered_json{{"kernels", options.kernels}, {"rows", to_json(rows)}}.dump());
  return code;
}

}  // namespace
}  // namespace farfeel::bench

int main(int argc, char** argv) {
  using namespace farfeel;
  CLI::App app("How much work is done along frozen motions: the same on every machine", "farfeel-bench count");
  bench::Options options;
  app.add_option("--inputs", options.inputs, "Folder of the frozen motions")->capture_default_str();
  auto* const kernels =
      app.add_option("--kernels", options.kernels, "Of the depths: counts differ by up to a tenth between them")
          ->check(CLI::IsMember({"avx2", "plain"}))
          ->capture_default_str();
  auto* const only = app.add_option("--only", options.only, "Rows whose name holds this");
  app.add_option("--check", options.check, "Compare with the newest entry of this history")->excludes(kernels);
  auto* const record = app.add_option("--record", options.record, "Add an entry to this history");
  record->excludes(kernels)->excludes(only);
  record->needs(app.add_option("--commit", options.commit, "The entry's commit, or the one before it"));
  record->needs(app.add_option("--why", options.why, "What changed the counts"));
  app.add_option("--history", options.history, "Print this history, and count nothing");
  app.add_option("--freeze", options.freeze, "Make the motions in this folder anew, and count nothing");
  app.add_flag("--json", options.is_json, "One JSON object as the last line");
  if (const auto done = farfeel::codecs::parse_command_line(app, argc, argv)) return *done;
  try {
    return bench::run(options);
  } catch (const CLI::Error& error) {
    fmt::print(stderr, "farfeel-bench count: {}\n", error.what());
    return 1;
  }
}
