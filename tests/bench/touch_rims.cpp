#include "tests/bench/touch_rims.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/bench/on_all_cores.h"

namespace farfeel::bench {
namespace {

using nlohmann::json;

constexpr const char* kBall = "ball-6";
constexpr std::array<double, 3> kClear_mm{0.1, 0.2, 0.5};
constexpr double kPressed_m = 0.3e-3;
constexpr double kMostFlagged = 0.05;
constexpr std::uint32_t kPassagesAtOnce = 12;  // one piece of work of a core

struct ModelRows {
  std::array<RimRow, kClear_mm.size()> rows;
  std::vector<std::uint32_t> pushed, missed;  // passages
};

/// Passages from first on. The number of a passage says how clear it is, too.
ModelRows carried(const TouchSubject& subject, const FreeEdges& edges, const TouchTool& ball, std::uint64_t seed,
                  std::uint32_t first, std::uint32_t count, const PassageWitness& witness = {}) {
  ModelRows all;
  Carrier carrier(subject, ball);
  for (std::uint32_t i = first; i < first + count; ++i) {
    const std::size_t clear = i % kClear_mm.size();
    const auto passage = passage_on(subject, edges, ball, 1e-3 * kClear_mm[clear], seed, i);
    if (!passage) continue;
    const Passed passed = carrier.carry(*passage, witness);
    if (witness) {
      const glm::dvec3 out = passage->pressed.out_O;
      fmt::print("    pressed {:.3f} mm along ({:.3f} {:.3f} {:.3f}): told {:.3f} mm, {:.3f} N, doubts {:#x}\n",
                 1e3 * passed.pressed.truth.main.depth_m, -out.x, -out.y, -out.z, 1e3 * passed.pressed.depth_m,
                 glm::length(passed.pressed.force_N), passed.pressed.doubts);
    }
    all.rows[clear].add(passed);
    if (passed.is_pushed) all.pushed.push_back(i);
    if (passed.is_missed) all.missed.push_back(i);
  }
  return all;
}

ModelRows carried_on_all_cores(const TouchSubject& subject, const FreeEdges& edges, const TouchTool& ball,
                               std::uint64_t seed, std::uint32_t passages) {
  const std::uint32_t pieces = (passages + kPassagesAtOnce - 1) / kPassagesAtOnce;
  std::vector<ModelRows> parts(pieces);
  on_all_cores(pieces, [&](std::size_t piece) {
    const auto first = static_cast<std::uint32_t>(piece) * kPassagesAtOnce;
    parts[piece] = carried(subject, edges, ball, seed, first, std::min(kPassagesAtOnce, passages - first));
  });
  ModelRows sum;
  for (const ModelRows& part : parts) {
    for (std::size_t clear = 0; clear < kClear_mm.size(); ++clear) sum.rows[clear].add(part.rows[clear]);
    sum.pushed.insert(sum.pushed.end(), part.pushed.begin(), part.pushed.end());
    sum.missed.insert(sum.missed.end(), part.missed.begin(), part.missed.end());
  }
  return sum;
}

/// Each answer that pushes or doubts: how clear the ball is, and what its contacts say.
PassageWitness teller(const TouchSubject& subject) {
  return [&subject](const PassageTick& tick) {
    if (!(glm::length(tick.set.F_To_W.force_N) > kNoForce_N) && tick.told.doubts == 0) return;
    const glm::dvec3 p = 1e3 * tick.set.X_WT.p;
    fmt::print("    ball at ({:.3f} {:.3f} {:.3f}) mm, {:.3f} mm clear: {:.3f} N\n", p.x, p.y, p.z, 1e3 * tick.clear_m,
               glm::length(tick.set.F_To_W.force_N));
    for (std::uint32_t i = 0; i < tick.set.count; ++i) {
      const contact::Contact& c = tick.set.contacts[i];
      const glm::dvec3 q = 1e3 * c.p_WC_W, n = c.nhat_ST_W;
      fmt::print(
          "      contact {}: {:.3f} mm deep at ({:.3f} {:.3f} {:.3f}), {:.3f} mm from the mesh, along ({:.3f} "
          "{:.3f} {:.3f}), doubts {:#x}\n",
          c.id.number, 1e3 * c.depth_m, q.x, q.y, q.z, 1e3 * subject.truth.nearest(c.p_WC_W).distance_m, n.x, n.y, n.z,
          c.doubts);
    }
  };
}

json row_told(const std::string& model, double clear_mm, const RimRow& row, double allowed_m) {
  const auto share = [&](std::uint64_t of) {
    return row.passages > 0 ? static_cast<double>(of) / static_cast<double>(row.passages) : 0;
  };
  json doubts = json::object();
  for (std::size_t d = 0; d < row.doubted.size(); ++d)
    doubts[std::string(contact::kNamedDoubts[d].name)] = share(row.doubted[d]);
  return {{"model", model},
          {"clear_mm", clear_mm},
          {"passages", row.passages},
          {"pushed", row.pushed},
          {"force_N_max", row.force_N_max},
          {"flagged", share(row.flagged)},
          {"flagged_right", share(row.right_flagged)},
          {"off_unflagged", share(row.off_unflagged)},
          {"doubts", doubts},
          {"missed_pressed", row.missed_pressed},
          {"allowed_um", 1e6 * allowed_m}};
}

void print_row(const std::string& model, const std::string& clear_mm, const RimRow& row, double allowed_m) {
  const json told = row_told(model, 0, row, allowed_m);
  const auto share = [&](const char* name) { return told[name].get<double>(); };
  fmt::print("{:<16}{:>9}{:>10}{:>8}{:>12.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>16}{:>7.0f} ", model, clear_mm, row.passages,
             row.pushed, row.force_N_max, share("flagged"), share("flagged_right"), share("off_unflagged"),
             row.missed_pressed, 1e6 * allowed_m);
  for (const auto& [name, of] : told["doubts"].items()) {
    if (of.get<double>() > 0) fmt::print(" {} {:.3f}", name, of.get<double>());
  }
  fmt::print("\n");
  std::fflush(stdout);
}

}  // namespace

Carrier::Carrier(const TouchSubject& subject, const TouchTool& ball)
    : subject_(subject), ball_(ball), service_(touch_service(subject, ball)), presser_(subject, ball) {}

Passed Carrier::carry(const Passage& passage, const PassageWitness& witness) {
  Passed passed;
  service_.restart();
  const double step_s = passage.step_m / passage.speed_m_s;
  for (std::uint32_t i = 0; i < passage.p_O.size(); ++i) {
    const glm::dvec3& p = passage.p_O[i];
    const glm::dvec3 came_m = i > 0 ? p - passage.p_O[i - 1] : glm::dvec3(0);
    const auto time_ns = std::llround(1e9 * step_s * i);
    const contact::ContactSet& set = service_.answer({i, time_ns, {passage.pressed.R_OT, p}, {{}, came_m / step_s}});
    const PassageTick tick{subject_.truth.nearest(p).distance_m - ball_.shape.radius_m, told_depth(set), set};
    const double force_N = glm::length(set.F_To_W.force_N);
    passed.force_N = std::max(passed.force_N, force_N);
    passed.is_pushed |= force_N > kFalseForce_N && tick.clear_m > subject_.allowed_m() + kClearWithin_m;
    passed.doubts |= tick.told.doubts;
    const bool is_off =
        set.count > 0 && std::abs(tick.told.depth_m + tick.clear_m) > subject_.allowed_m() + kClearWithin_m;
    (tick.told.doubts != 0 ? passed.is_off_flagged : passed.is_off_unflagged) |= is_off;
    if (witness) witness(tick);
  }
  passed.pressed = presser_.press(passage.pressed, {kPressed_m}).at[0];
  passed.is_missed = judge(passed.pressed, {}, subject_.allowed_m()).missed;
  return passed;
}

void RimRow::add(const Passed& passed) {
  ++passages;
  pushed += passed.is_pushed, missed_pressed += passed.is_missed;
  flagged += passed.doubts != 0, right_flagged += passed.doubts != 0 && !passed.is_off_flagged;
  off_unflagged += passed.is_off_unflagged;
  for (std::size_t d = 0; d < doubted.size(); ++d) doubted[d] += (passed.doubts & contact::kNamedDoubts[d].bit) != 0;
  force_N_max = std::max(force_N_max, passed.force_N);
}

void RimRow::add(const RimRow& other) {
  passages += other.passages, pushed += other.pushed, missed_pressed += other.missed_pressed;
  flagged += other.flagged, right_flagged += other.right_flagged, off_unflagged += other.off_unflagged;
  for (std::size_t d = 0; d < doubted.size(); ++d) doubted[d] += other.doubted[d];
  force_N_max = std::max(force_N_max, other.force_N_max);
}

json run_rims(const RimChoice& choice) {
  const auto ball = touch_tool(kBall, choice.is_anew);
  const auto models = std::max<std::uint32_t>(1, static_cast<std::uint32_t>(choice.models.size()));
  const std::uint32_t passages = (choice.passages + models - 1) / models;
  fmt::print(
      "\nfree edges, a ball of 6 mm that passes by clear\n{:<16}{:>9}{:>10}{:>8}{:>12}{:>9}{:>9}{:>9}{:>16}{:>7}  "
      "doubts\n",
      "model", "clear mm", "passages", "pushed", "force N max", "flagged", "right", "off", "missed pressed", "a um");
  json told = json::array();
  RimRow sum;
  for (const TouchModel& model : choice.models) {
    const auto add_lacking = [&](const std::string& reason) {
      fmt::print("{:<16}not passed: {}\n", model.name, reason);
      for (const double clear_mm : kClear_mm) {
        told.push_back(row_told(model.name, clear_mm, {}, 0));
        told.back()["reason"] = reason;
      }
    };
    const auto mesh = touch_mesh(model);
    auto baked = mesh ? kept_asset(model.name, *mesh, choice.is_anew) : tl::unexpected(mesh.error());
    if (!baked) {
      add_lacking(baked.error());
      continue;
    }
    const TouchSubject subject(*std::move(baked));
    const FreeEdges edges(subject.baked.original_O);
    if (edges.is_empty()) {
      add_lacking("no edge stands out sharply");
      continue;
    }
    const ModelRows rows = choice.only >= 0 ? carried(subject, edges, *ball, choice.seed,
                                                      static_cast<std::uint32_t>(choice.only), 1, teller(subject))
                                            : carried_on_all_cores(subject, edges, *ball, choice.seed, passages);
    for (std::size_t clear = 0; clear < kClear_mm.size(); ++clear) {
      print_row(model.name, fmt::format("{:g}", kClear_mm[clear]), rows.rows[clear], subject.allowed_m());
      told.push_back(row_told(model.name, kClear_mm[clear], rows.rows[clear], subject.allowed_m()));
      if (rows.rows[clear].passages == 0) told.back()["reason"] = "no edge was found that the ball reaches";
      sum.add(rows.rows[clear]);
    }
    const auto print_first = [&](const char* what, const std::vector<std::uint32_t>& numbers) {
      if (!numbers.empty())
        fmt::print("    {}: --model {} --seed {} --passage {}\n", what, model.name, choice.seed, numbers.front());
    };
    print_first("pushed", rows.pushed);
    print_first("missed when pressed", rows.missed);
  }
  print_row("all", "all", sum, 0);
  const double flagged = sum.passages > 0 ? static_cast<double>(sum.flagged) / static_cast<double>(sum.passages) : 0;
  fmt::print(
      "goals, over all passages:\n  {} pushed: {} of {}\n  {} missed when pressed: {}\n  {} flagged: {:.1f} %, "
      "at most {:g} %\n",
      sum.pushed == 0 ? "met    " : "NOT MET", sum.pushed, sum.passages,
      sum.missed_pressed == 0 ? "met    " : "NOT MET", sum.missed_pressed,
      flagged <= kMostFlagged ? "met    " : "NOT MET", 100 * flagged, 100 * kMostFlagged);
  return told;
}

}  // namespace farfeel::bench
