// Mechanisms with closed forms, simulated in closed loop: coupling, tool, rows. What `farfeel-bench mechanisms` runs.
#pragma once

#include <string>
#include <vector>

#include "tests/support/row_loop.h"

namespace farfeel::bench {

/// The default coupling and material of all cases: K k / (K + k) = 667 N/m.
inline constexpr tool::CouplingGains kMechanismGains{2000, 1, 5, 0.005};
inline constexpr test_support::Stuff kMechanismStuff{};

struct MechanismRow {
  std::string name;
  double error = 0;  ///< what was measured, less what the closed form says
  double limit = 0;
  std::string unit;              ///< of both
  std::vector<double> solve_us;  ///< of each tick's step: matrix, rows, friction, proxy
  bool is_goal = true;           ///< false: told for comparison alone
};

/// e sum lambda + 1 um: what a held axis may give at the proxy.
[[nodiscard]] double held_limit_m(const test_support::RowLoop&);

void add_held_axes(std::vector<MechanismRow>&);    ///< key, hinge, bore, thread; tipping; walls without room
void add_felt_pads(std::vector<MechanismRow>&);    ///< walls, duplicates, rows that blink, groove, levers, recess
void add_round_edges(std::vector<MechanismRow>&);  ///< a tool that slides off them
void add_friction(std::vector<MechanismRow>&);     ///< slopes, holding still, wedges, drilling
void add_solve_times(std::vector<MechanismRow>&);  ///< 11 contacts at random

}  // namespace farfeel::bench
