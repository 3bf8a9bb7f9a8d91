// Which sessions are run, and what they sum up to.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>

#include "tests/bench/on_all_cores.h"
#include "tests/bench/touch_sessions.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 8> kSessionModels{"bowl-3",   "cup-3",    "leaf-0.5",    "wall-1",
                                                    "fins-1.5", "sponge-4", "cheburashka", "beast"};
constexpr const char* kSessionTool = "ball-6";
constexpr std::array<double, 4> kHands_N{1, 3, 10, 30};
constexpr std::array<HandMotion, 3> kMotions{HandMotion::kPress, HandMotion::kStroke, HandMotion::kJab};
constexpr const char* kBadLink = "rtt=100ms jitter=10ms loss=2%,burst=5";
constexpr double kRunUp_m = 0.06;        // of a jab, where there is room for it
constexpr double kMostExtra_m = 0.3e-3;  // of the first touch across the link
constexpr std::uint32_t kMostPlaceTries = 50;

/// One hand at one place, without a link and across it.
struct HandPair {
  SessionPlan plan;
  std::uint32_t number;  ///< among the model's
  SessionFigures without, across;
};

std::vector<HandPair> planned(const TouchSubject& subject, const TouchTool& tool, const SessionChoice& choice,
                              std::uint32_t pairs) {
  std::vector<HandPair> all;
  std::uint32_t index = 0;
  for (std::uint32_t n = 0; n < pairs; ++n) {
    HandPair pair{};
    pair.plan.contact = choice.contact;
    pair.plan.hand_N = kHands_N[n % kHands_N.size()];
    pair.plan.motion = kMotions[n / kHands_N.size() % kMotions.size()];
    // Textured, so tiles are felt; the other rung is what is felt until they come, and on a slow machine.
    pair.plan.rung = (n / kHands_N.size() + n) % 2 == 0 ? local_model::Rung::kTiles : local_model::Rung::kLinear;
    std::optional<Place> place;
    for (std::uint32_t tried = 0; tried < kMostPlaceTries && !place; ++tried)
      place = place_on(subject, tool, choice.seed, index++);
    if (!place) break;
    pair.number = n;
    if (pair.plan.motion == HandMotion::kJab) place->free_way_m = free_way_m(subject, tool, *place, kRunUp_m);
    pair.plan.place = *place;
    pair.plan.link_seed = choice.seed + n;
    if (choice.only < 0 || choice.only == n) all.push_back(pair);
  }
  return all;
}

/// What an asset states to be off by excuses depth up to this.
constexpr double kMostStated_m = 0.3e-3;

struct Row {
  int runs = 0, through = 0, faults = 0, without_force_ms_max = 0;
  double first_touch_extra_mm = 0, deepest_mm = 0, tool_depth_extra_mm = 0;

  [[nodiscard]] json told(const std::string& model, const std::string& link, double hand_N) const {
    return {{"model", model},
            {"link", link},
            {"hand_N", hand_N},
            {"runs", runs},
            {"through", through},
            {"without_force_ms_max", without_force_ms_max},
            {"first_touch_extra_mm", first_touch_extra_mm},
            {"deepest_mm", deepest_mm},
            {"tool_depth_extra_mm", tool_depth_extra_mm},
            {"faults", faults}};
  }

  void add(const SessionFigures& f, double extra_m, double stated_m) {
    ++runs, through += f.is_through(), faults += f.is_fault;
    without_force_ms_max = std::max(without_force_ms_max, f.without_force_ms);
    first_touch_extra_mm = std::max(first_touch_extra_mm, 1e3 * extra_m);
    deepest_mm = std::max(deepest_mm, 1e3 * f.deepest_m);
    tool_depth_extra_mm = std::max(tool_depth_extra_mm, 1e3 * (f.deepest_m - std::min(stated_m, kMostStated_m)));
  }
};

void print_failure(const HandPair& pair, const SessionFigures& f, const std::string& model, const std::string& link) {
  const glm::dvec3 at = 1e3 * pair.plan.place.p_touch_O;
  fmt::print(
      "    through: --model {} --session {}: {} N, {}, {}, {}, from ({:.3f} {:.3f} {:.3f}) mm: {} ms, {} ms without "
      "force, "
      "{:.2f} mm deep{}\n",
      model, pair.number, pair.plan.hand_N, name(pair.plan.motion), local_model::name(pair.plan.rung), link, at.x, at.y,
      at.z, f.through_ms, f.without_force_ms, 1e3 * f.deepest_m, f.is_fault ? ", fault" : "");
}

/// As the judge sees it from kNear_m on, each kTold_ms, and each tick in which it overlaps without a force.
SessionWitness teller() {
  constexpr int kTold_ms = 5;
  constexpr double kNear_m = 1e-3;
  fmt::print("{:>7}{:>10}{:>9}{:>9}{:>9}  {:<26}{:<26}{}\n", "ms", "depth mm", "force N", "back N", "hand N", "at mm",
             "out", "side");
  return [](const SessionTick& tick) {
    const double force_N = glm::length(tick.force_N);
    if (tick.way.depth_m < -kNear_m || tick.time_ms < 0) return;
    if (tick.time_ms % kTold_ms != 0 && !(tick.way.depth_m > 0 && force_N == 0)) return;
    const glm::dvec3 at = 1e3 * tick.p_O, out = tick.way.out_O;
    fmt::print("{:>7}{:>10.3f}{:>9.3f}{:>9.3f}{:>9.3f}  ({:.3f} {:.3f} {:.3f})  ({:.3f} {:.3f} {:.3f})  {}\n",
               tick.time_ms, 1e3 * tick.way.depth_m, force_N, glm::dot(tick.force_N, out), tick.hand_N, at.x, at.y,
               at.z, out.x, out.y, out.z, tick.is_behind ? "behind" : "before");
  };
}

}  // namespace

json run_sessions(const SessionChoice& choice) {
  const transport::LinkSpec bad = transport::parse_link_spec(kBadLink).value();
  std::vector<std::string> names = choice.models;
  if (names.empty()) names.assign(kSessionModels.begin(), kSessionModels.end());
  const std::vector<TouchModel> models = touch_models(choice.scans);
  const auto tool = touch_tool(kSessionTool, choice.is_anew);
  const auto pairs = static_cast<std::uint32_t>((choice.sessions + 2 * names.size() - 1) / (2 * names.size()));
  fmt::print("\nsessions, a ball of 6 mm\n{:<16}{:<40}{:>8}{:>6}{:>9}{:>8}{:>15}{:>16}{:>12}{:>10}\n", "model", "link",
             "hand N", "runs", "through", "faults", "no force ms", "touch extra mm", "deepest mm", "extra mm");
  json told = json::array();
  Row sum;
  for (const std::string& name : names) {
    const auto model = std::find_if(models.begin(), models.end(), [&](const TouchModel& m) { return m.name == name; });
    if (model == models.end()) continue;
    const auto mesh = touch_mesh(*model);
    auto baked = mesh ? kept_asset(name, *mesh, choice.is_anew) : tl::unexpected(mesh.error());
    if (!baked) {
      fmt::print("{:<16}not touched: {}\n", name, baked.error());
      for (const char* link : {"none", kBadLink}) {
        for (const double hand_N : kHands_N) {
          told.push_back(Row{}.told(name, link, hand_N));
          told.back()["reason"] = baked.error();
        }
      }
      continue;
    }
    const TouchSubject subject(*std::move(baked));
    const FeltPair pair(name, subject.baked.asset.felt, tool->baked.asset.felt);
    std::vector<HandPair> hands = planned(subject, *tool, choice, pairs);
    const auto run = [&](std::size_t i) {
      HandPair& hand = hands[i / 2];
      SessionPlan plan = hand.plan;
      if (i % 2 == 1) plan.link = bad;
      (i % 2 == 0 ? hand.without : hand.across) =
          run_session(pair, subject, *tool, plan, choice.only >= 0 ? teller() : SessionWitness{});
    };
    if (choice.only < 0) {
      on_all_cores(2 * hands.size(), run);
    } else {
      for (std::size_t i = 0; i < 2 * hands.size(); ++i) run(i);
    }
    for (const bool is_across : {false, true}) {
      const std::string link = is_across ? kBadLink : "none";
      for (const double hand_N : kHands_N) {
        Row row;
        for (const HandPair& hand : hands) {
          if (hand.plan.hand_N != hand_N) continue;
          const SessionFigures& f = is_across ? hand.across : hand.without;
          const double extra_m = is_across ? std::max(0.0, f.first_touch_m - hand.without.first_touch_m) : 0;
          row.add(f, extra_m, subject.baked.p999_m), sum.add(f, extra_m, subject.baked.p999_m);
          if (f.is_through()) print_failure(hand, f, name, link);
        }
        json j = row.told(name, link, hand_N);
        if (row.runs == 0) j["reason"] = "no place was found with a way in, or too few sessions were asked for";
        told.push_back(std::move(j));
        fmt::print("{:<16}{:<40}{:>8}{:>6}{:>9}{:>8}{:>15}{:>16.2f}{:>12.2f}{:>10.2f}\n", name, link, hand_N, row.runs,
                   row.through, row.faults, row.without_force_ms_max, row.first_touch_extra_mm, row.deepest_mm,
                   row.tool_depth_extra_mm);
        std::fflush(stdout);
      }
    }
  }
  fmt::print(
      "goals, over all sessions:\n  {} through: {} of {}\n  {} first touch: at most {:.2f} mm deeper across the "
      "link, wanted {:g}; longest without force {} ms\n",
      sum.through == 0 ? "met    " : "NOT MET", sum.through, sum.runs,
      sum.first_touch_extra_mm <= 1e3 * kMostExtra_m ? "met    " : "NOT MET", sum.first_touch_extra_mm,
      1e3 * kMostExtra_m, sum.without_force_ms_max);
  return told;
}

}  // namespace farfeel::bench
