// Whether rows that may not be left make mechanisms: what is free stays free, what is held stays held, material yields
// once, and friction holds.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/bench/mechanisms_cases.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

int run(bool as_json, bool is_untimed) {
  std::vector<MechanismRow> found;
  add_held_axes(found);
  add_felt_pads(found);
  add_round_edges(found);
  add_friction(found);
  if (!is_untimed) add_solve_times(found);

  json rows = json::array();
  std::size_t missed = 0;
  fmt::print("{:58} {:>11} {:>11} {:6} {:>15}\n", "case", "error", "limit", "unit", "step us p50 p99");
  for (const MechanismRow& row : found) {
    const bool is_met = row.error <= row.limit;
    missed += row.is_goal && !is_met;
    const double p50_us = support::quantile(row.solve_us, 0.5), p99_us = support::quantile(row.solve_us, 0.99);
    fmt::print("{:58} {:11.4g} {:11.4g} {:6} {:7.2f} {:7.2f}{}\n", row.name, row.error, row.limit, row.unit, p50_us,
               p99_us,
               is_met        ? ""
               : row.is_goal ? "  MISSED"
                             : "  (compared)");
    rows.push_back({{"case", row.name},
                    {"error", row.error},
                    {"limit", row.limit},
                    {"unit", row.unit},
                    {"is_goal", row.is_goal},
                    {"is_met", is_met},
                    {"solve_us", {{"p50", p50_us}, {"p99", p99_us}}}});
  }
  fmt::print("{} of {} rows are within their limits\n", found.size() - missed, found.size());
  if (as_json) fmt::print("{}\n", json{{"rows", rows}, {"is_met", missed == 0}}.dump());
  return missed == 0 ? 0 : 1;
}

}  // namespace

void add_mechanisms(CLI::App& bench) {
  auto as_json = std::make_shared<bool>(false), is_untimed = std::make_shared<bool>(false);
  CLI::App* app = bench.add_subcommand("mechanisms", "Mechanisms with closed forms, under contacts as constraints");
  app->add_flag("--json", *as_json, "one JSON object as the last line");
  app->add_flag("--untimed", *is_untimed, "without the rows whose limit is a time: their verdict is the machine's");
  app->callback([as_json, is_untimed] {
    if (const int status = run(*as_json, *is_untimed); status != 0) throw CLI::RuntimeError(status);
  });
}

}  // namespace farfeel::bench
