// farfeel-bench touch: does what is pressed push back, the right way and by the right depth? The judge is the original
// mesh (touch_truth.h). Places are pressed and free edges passed by on the contact service alone; sessions are hands in
// closed loop.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "tests/bench/bench.h"
#include "tests/bench/on_all_cores.h"
#include "tests/bench/touch_rims.h"
#include "tests/bench/touch_rows.h"
#include "tests/bench/touch_sessions.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr std::uint32_t kSampledPlaces = 100'000, kQuickPlaces = 3'000;  // in all
constexpr std::uint32_t kFullPlaces = 3'000;                             // a model, tool and depth
constexpr std::uint32_t kSampledSessions = 200, kQuickSessions = 16, kFullSessions = 1'600;
constexpr std::uint32_t kSampledPassages = 3'000, kQuickPassages = 300, kFullPassages = 20'000;
constexpr std::uint32_t kPlacesAtOnce = 50;  // one piece of work of a core
constexpr double kMostFalseShare = 1e-4, kMostUnflaggedShare = 1e-4, kMostFlaggedRight = 0.01;

struct Options {
  std::vector<std::string> models, tools;
  std::vector<double> presses_mm{0.05, 0.3, 1, 3};
  std::string scans, contact = "penalty";
  std::uint64_t seed = 1;
  std::uint32_t places = 0;    ///< in all; 0: as the form says
  std::int64_t place = -1;     ///< only this one, and no sessions
  std::int64_t session = -1;   ///< only this hand of each model, told tick by tick; and no places
  std::int64_t sessions = -1;  ///< in all; < 0: as the form says
  std::int64_t passages = -1;  ///< by free edges, in all; < 0: as the form says
  std::int64_t passage = -1;   ///< only this one of each model, told answer by answer; and nothing else
  bool is_full = false, is_quick = false, is_json = false, is_anew = false;
  bool has_places = true;
};

/// What the form of about a minute looks at.
const std::vector<std::string> kQuickModels{"bowl-3", "cup-3", "lens-8", "fins-1.5", "saw-2", "leaf-0.5", "wall-1"};

bool is_among(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<TouchModel> chosen_models(const Options& options) {
  std::vector<TouchModel> all = touch_models(options.scans);
  for (const std::string& name : options.models) {
    if (std::none_of(all.begin(), all.end(), [&](const TouchModel& m) { return m.name == name; })) {
      std::string known;
      for (const TouchModel& m : all) known += " " + m.name;
      throw CLI::ValidationError("--model", fmt::format("there is no model {}; there are{}", name, known));
    }
  }
  const auto& names = options.models.empty() && options.is_quick ? kQuickModels : options.models;
  std::erase_if(all, [&](const TouchModel& m) { return !is_among(names, m.name); });
  return all;
}

/// What one model and tool gave, a row a depth.
struct PairRows {
  std::vector<TouchRow> rows;
  TouchFailures failures;
};

void press_place(Presser& presser, const TouchSubject& subject, const TouchTool& tool, const Options& options,
                 std::uint32_t index, const std::vector<double>& depths_m, PairRows& out) {
  const auto place = place_on(subject, tool, options.seed, index);
  if (!place) return;
  const Pressed pressed = presser.press(*place, depths_m);
  for (std::size_t d = 0; d < depths_m.size(); ++d) {
    const Verdict v = judge(pressed.at[d], pressed.before, subject.allowed_m());
    out.rows[d].add(pressed.at[d], v);
    const auto note = [&](bool is_wrong, const char* kind) {
      if (!is_wrong) return;
      out.failures.add(
          {kind, subject.baked.asset.name, tool.name, options.seed, index, pressed.at[d], pressed.before, *place});
    };
    note(v.missed, "missed"), note(v.is_false, "false"), note(v.inward, "inward"), note(v.unflagged, "unflagged");
    note(options.place >= 0, TouchFailures::kAskedFor);
  }
}

PairRows press_pair(const TouchSubject& subject, const TouchTool& tool, const Options& options,
                    const std::vector<double>& depths_m, std::uint32_t places) {
  const std::uint32_t first = options.place >= 0 ? static_cast<std::uint32_t>(options.place) : 0;
  const std::uint32_t pieces = (places + kPlacesAtOnce - 1) / kPlacesAtOnce;
  std::vector<PairRows> parts(pieces);
  on_all_cores(pieces, [&](std::size_t piece) {
    parts[piece].rows.resize(depths_m.size());
    Presser presser(subject, tool);
    const auto from = static_cast<std::uint32_t>(piece) * kPlacesAtOnce;
    for (std::uint32_t i = from; i < std::min(places, from + kPlacesAtOnce); ++i)
      press_place(presser, subject, tool, options, first + i, depths_m, parts[piece]);
  });
  PairRows sum;
  sum.rows.resize(depths_m.size());
  for (const PairRows& part : parts) {
    for (std::size_t d = 0; d < depths_m.size(); ++d) sum.rows[d].add(part.rows[d]);
    sum.failures.add(part.failures);
  }
  return sum;
}

void print_header() {
  fmt::print("{:<16}{:<10}{:>8}{:>8}{:>8}{:>8}{:>10}{:>9}{:>9}{:>9}{:>9}{:>7}\n", "model", "tool", "places", "missed",
             "false", "inward", "unflagged", "flagged", "dir p95", "um p50", "um p99", "a um");
}

void print_row(const std::string& model, const std::string& tool, const TouchRow& row, double allowed_m) {
  fmt::print("{:<16}{:<10}{:>8}{:>8}{:>8}{:>8}{:>10}{:>9.4f}{:>9.2f}{:>9.1f}{:>9.0f}{:>7.0f}\n", model, tool,
             row.places, row.missed, row.is_false, row.inward, row.unflagged, row.flagged_right(),
             quantile(row.angles_deg, 0.95), quantile(row.depth_errors_um, 0.5), quantile(row.depth_errors_um, 0.99),
             1e6 * allowed_m);
  std::fflush(stdout);
}

void print_goal(const char* what, std::uint64_t count, std::uint64_t of, double most) {
  const bool is_met = static_cast<double>(count) <= most * static_cast<double>(of);
  fmt::print("  {:<9} {:<14} {} of {} ({:.4f} %), at most {:g} %\n", is_met ? "met" : "NOT MET", what, count, of,
             of > 0 ? 100.0 * static_cast<double>(count) / static_cast<double>(of) : 0, 100 * most);
}

/// How many of something the form has, unless somebody says otherwise.
std::uint32_t by_form(const Options& options, std::int64_t asked, std::uint32_t quick, std::uint32_t sampled,
                      std::uint32_t full) {
  if (asked >= 0) return static_cast<std::uint32_t>(asked);
  return options.is_full ? full : options.is_quick ? quick : sampled;
}

json press_all(const Options& options, const std::vector<double>& depths_m) {
  const std::vector<TouchModel> models = chosen_models(options);
  const std::vector<std::string> tool_names = options.tools.empty() ? touch_tool_names() : options.tools;
  std::vector<std::unique_ptr<TouchTool>> tools;
  for (const std::string& name : tool_names) tools.push_back(touch_tool(name, options.is_anew));
  std::uint32_t in_all = options.places;
  if (in_all == 0) in_all = options.is_quick ? kQuickPlaces : kSampledPlaces;
  const auto rows_wanted = static_cast<std::uint32_t>(models.size() * tools.size() * depths_m.size());
  std::uint32_t places = options.is_full ? kFullPlaces : (in_all + rows_wanted - 1) / rows_wanted;
  if (options.place >= 0) places = 1;

  print_header();
  json told = json::array();
  TouchRow sum;
  TouchFailures failures;
  for (const TouchModel& model : models) {
    const auto add_lacking = [&](const std::string& reason) {
      fmt::print("{:<16}not touched: {}\n", model.name, reason);
      for (const auto& tool : tools) {
        for (const double depth_m : depths_m) {
          told.push_back(row_json(model.name, tool->name, depth_m, {}, 0));
          told.back()["reason"] = reason;
        }
      }
    };
    const auto mesh = touch_mesh(model);
    if (!mesh) {
      add_lacking(mesh.error());
      continue;
    }
    auto baked = kept_asset(model.name, *mesh, options.is_anew);
    if (!baked) {
      add_lacking(baked.error());
      continue;
    }
    const TouchSubject subject(*std::move(baked));
    for (const auto& tool : tools) {
      const PairRows pair = press_pair(subject, *tool, options, depths_m, places);
      TouchRow pair_sum;
      for (std::size_t d = 0; d < depths_m.size(); ++d) {
        told.push_back(row_json(model.name, tool->name, depths_m[d], pair.rows[d], subject.allowed_m()));
        if (pair.rows[d].places == 0) told.back()["reason"] = "no place was found with a way in for this tool";
        pair_sum.add(pair.rows[d]);
      }
      print_row(model.name, tool->name, pair_sum, subject.allowed_m());
      sum.add(pair_sum);
      failures.add(pair.failures);
    }
  }
  print_row("all", "all", sum, 0);
  failures.print();
  fmt::print("goals, over all places:\n");
  print_goal("inward", sum.inward, sum.places, 0);
  print_goal("missed", sum.missed, sum.places, 0);
  print_goal("false", sum.is_false, sum.places, kMostFalseShare);
  print_goal("unflagged", sum.unflagged, sum.places, kMostUnflaggedShare);
  print_goal("flagged_right", sum.right_flagged, sum.right, kMostFlaggedRight);
  return told;
}

void run(Options options) {
  if (options.scans.empty()) {
    const char* folder = std::getenv("FARFEEL_MODELS");
    if (folder != nullptr) options.scans = folder;
  }
  std::vector<double> depths_m;
  for (const double mm : options.presses_mm) depths_m.push_back(1e-3 * mm);
  std::sort(depths_m.begin(), depths_m.end());
  const auto started = std::chrono::steady_clock::now();
  if (options.session >= 0 || options.passage >= 0) options.has_places = false;
  const json rows = options.has_places ? press_all(options, depths_m) : json::array();
  json rims = json::array(), sessions = json::array();
  options.is_anew = options.is_anew && !options.has_places;
  const std::uint32_t passages = by_form(options, options.passages, kQuickPassages, kSampledPassages, kFullPassages);
  if (options.place < 0 && options.session < 0 && passages > 0) {
    rims = run_rims({.models = chosen_models(options),
                     .seed = options.seed,
                     .passages = passages,
                     .only = options.passage,
                     .is_anew = std::exchange(options.is_anew, false)});
  }
  const std::uint32_t sessions_wanted =
      by_form(options, options.sessions, kQuickSessions, kSampledSessions, kFullSessions);
  if (options.place < 0 && options.passage < 0 && sessions_wanted > 0) {
    SessionChoice choice{.models = options.models,
                         .scans = options.scans,
                         .seed = options.seed,
                         .sessions = sessions_wanted,
                         .only = options.session,
                         .contact = local_model::find_contact_law(options.contact).value(),
                         .is_anew = options.is_anew};
    if (options.is_quick && options.models.empty()) choice.models = {"bowl-3", "wall-1"};
    sessions = run_sessions(choice);
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - started;
  fmt::print("{:.0f} s\n", seconds.count());
  if (options.is_json)
    fmt::print("{}\n", json{{"rows", rows},
                            {"rims", rims},
                            {"sessions", sessions},
                            {"seed", options.seed},
                            {"seconds", seconds.count()}}
                           .dump());
}

}  // namespace

void add_touch(CLI::App& bench) {
  auto options = std::make_shared<Options>();
  CLI::App* touch = bench.add_subcommand(
      "touch",
      "What pressed places, passages by free edges and hands are told, against the original mesh: missed, false, "
      "inward, wrong depths");
  touch->add_flag("--full", options->is_full, "3,000 places for each model, tool and depth");
  touch->add_flag("--quick", options->is_quick, "a few models and places: about a minute");
  touch->add_option("--model", options->models, "only these models, by name");
  touch->add_option("--tool", options->tools,
                    "only these tools: ball-0.5, ball-3, ball-10, needle, or any ball-D in mm");
  touch->add_option("--press", options->presses_mm, "how deep, in mm")->capture_default_str();
  touch->add_option("--seed", options->seed, "of the places")->capture_default_str();
  touch->add_option("--places", options->places, "about so many in all, in place of 100,000");
  touch->add_option("--place", options->place, "only the place of this number, told in full");
  touch->add_option("--sessions", options->sessions, "about so many in all, in place of 200; 0 for none");
  touch->add_option("--session", options->session, "only the hand of this number, told tick by tick");
  touch->add_flag_callback(
      "--no-places", [options] { options->has_places = false; }, "passages and sessions alone");
  touch->add_option("--passages", options->passages,
                    "by free edges, about so many in all, in place of 3,000 (--full: 20,000); 0 for none");
  touch->add_option("--passage", options->passage, "only the passage of this number, told answer by answer");
  touch->add_option("--models", options->scans,
                    "the folder of beast.obj, cheburashka.obj and so on; else FARFEEL_MODELS");
  touch->add_option("--contact", options->contact, "how contacts push in sessions: as springs, or as constraints")
      ->check(CLI::IsMember({"penalty", "constraint"}))
      ->capture_default_str();
  touch->add_flag("--rebake", options->is_anew, "bake anew what the cache holds");
  touch->add_flag("--json", options->is_json, "one JSON object as the last line");
  touch->callback([options] { run(*options); });
}

}  // namespace farfeel::bench
