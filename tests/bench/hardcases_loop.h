// Hard cases of the haptic loop: each a press, stroke or twist in simulated time, with figures and a verdict.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptic_core/local_model/local_model.h"
#include "tests/bench/loop_watch.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

struct LoopCaseRow {
  std::string name, rung, grip;
  double tick_hz = 0, mass_kg = 0;
  transport::LinkSpec link;
  LoopFigures figures;
  double force_share = 1;  ///< of the mean force at the end, where the same is done without a link
  bool passes = false;
};

/// Cases whose name contains `only`, at a tick of a thousandth of a second or a whole fraction of it.
struct LoopCaseChoice {
  std::string only;
  std::optional<transport::LinkSpec> link;  ///< beside none, in place of all others
  int ticks_a_ms = 1;
  double stiffness_N_per_m = 0;  ///< of a contact; 0: as its material says
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;
  /// Asked of every row before any is run, in their order, without figures. Empty: all are taken.
  std::function<bool(const LoopCaseRow&)> takes{};

  [[nodiscard]] std::int64_t tick_ns() const { return 1'000'000 / ticks_a_ms; }
};

/// Surfaces in closed form that change under the tool, links that stall, ridges: hardcases_loop.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_changes(const LoopCaseChoice&);
/// Pegs, threads, gears, edges, tips, walls, through the real contact service: hardcases_real.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_real_shapes(const LoopCaseChoice&);
/// Thin walls that are jabbed at: hardcases_jabs.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_jabs(const LoopCaseChoice&);
/// Objects that turn, slide and rise under the tool: hardcases_moving.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_moving_objects(const LoopCaseChoice&);
/// Scenes that are explored while ticks are late and spared: hardcases_busy.cpp.
[[nodiscard]] std::vector<LoopCaseRow> judge_busy_machines(const LoopCaseChoice&);

/// Also by the force that is left of the same row without a link, where that is among them.
[[nodiscard]] std::vector<LoopCaseRow> with_forces_judged(std::vector<LoopCaseRow>);

}  // namespace farfeel::bench
