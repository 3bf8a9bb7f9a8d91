// What the rows push with in one step, and what friction holds.
//
// Friction stands at the proxy: a contact sticks where the proxy's point does not move across it,
//   T'(S' - S + h (v' + w' x r - v_S)) = 0,
// S the pad's shift from tool to proxy and T the directions across n. So what sticks stretches the pad, and W = h^2
// A^-1 + pad. Each contact's block is solved exactly into the cone of this step's l (friction_block.h), after all that
// stick together (contact_step.h). With a known patch, turning about n is the block's third axis, scaled by two thirds
// of the patch's radius: a disc that is pressed evenly holds so much less. Two rounds, starting from the last tick's
// forces: from none, a wedge slips out and three walls creep. With springs each row has its own: T'(f - f before) / k_t
// + h T'(...) = 0. What is not solved after that makes no energy: friction is weakened first.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "haptic_core/constraint/bounded_solver.h"
#include "haptic_core/constraint/row.h"
#include "haptic_core/constraint/row_problem.h"

namespace farfeel::constraint {

struct RowForce {
  std::uint64_t name = 0;
  double normal_N = 0;        ///< l: -l g is its wrench on the tool
  glm::dvec3 friction_W{0};   ///< on the tool at C, across the direction [N]
  double torsion_Nm = 0;      ///< on the tool, about nhat_ST_W
  double slack_m = 0;         ///< w: what its pad yields more than is asked for, because friction was solved after it
  bool is_sliding = false;    ///< it goes on to slide at the dynamic limit until it is caught
  bool is_saturated = false;  ///< pushes with the most it may: a squeeze that is no contact, to be told
};

/// What friction took and a step that is not quite solved may make, at most [J].
inline constexpr double kMostAfforded_J = 1e-4;

/// What one step leaves for the next.
struct ContactMemory {
  int count = 0;
  std::array<RowForce, kMaxRows> forces{};
  double afforded_J = kMostAfforded_J;
  glm::dvec3 pad_s_W{0};  ///< s, sqrt(k) times the shift from tool to proxy [J^(1/2)]
};

struct ContactForces {
  spatial::Vector6 F_To_W = spatial::Vector6::Zero();   ///< of all rows on the tool, held for the step
  spatial::Vector6 V_moved = spatial::Vector6::Zero();  ///< what the tool moves with under it
  glm::dvec3 friction_shift_W{0};                       ///< c sum T_j f_j: friction's part of the pad's shift [m]
  BoundedAnswer normal;                                 ///< as the solver has it, row by row
  int iterations = 0;
  int weakened = 0;  ///< how often friction was, so that a step that is not quite solved makes no energy
  bool is_solved = true;
  bool is_any_saturated = false;
};

/// Solves one step's rows. X_WT: at its beginning. memory is that of the step before, and of this one after. Rows that
/// have no namesake in it begin without friction. Bounded time, no allocation; realtime-safe; cannot fail.
void solve_contacts(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility&,
                    const Law&, ContactMemory& memory, ContactForces&) noexcept;

}  // namespace farfeel::constraint
