// What the rows push with in one step, and what friction holds.
//
// Friction stands at the proxy: a contact sticks where the proxy's point does not move across it,
//   T'(S' - S + h (v' + w' x r - v_S)) = 0,
// S the pad's shift from tool to proxy and T the directions across n. So what sticks stretches the pad. With a known
// patch, turning about n is a third direction, scaled by two thirds of the patch's radius: a disc that is pressed
// evenly holds so much less. With springs each row has its own: T'(f - f before) / k_t + h T'(...) = 0.
//
// What the pad holds is a state, s, and only the tool, by moving, and objects, by their script, may stretch it for
// nothing. A row whose depth is more than what the pad holds there has news: an update, a tile, a surface that curves,
// a normal that turned. News pushes as far as it can be afforded, and the rest of it is the row's recess: so a step
// makes no more energy than it may, whatever it is told.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "haptic_core/constraint/bounded_solver.h"
#include "haptic_core/constraint/mobility.h"
#include "haptic_core/constraint/row.h"

namespace farfeel::constraint {

struct RowForce {
  std::uint64_t name = 0;
  double normal_N = 0;        ///< l: -l g is its wrench on the tool
  glm::dvec3 friction_W{0};   ///< on the tool at C, across the direction [N]
  double torsion_Nm = 0;      ///< on the tool, about nhat_ST_W
  bool is_sliding = false;    ///< it goes on to slide at the dynamic limit until it is caught
  bool is_saturated = false;  ///< pushes with the most it may: a squeeze that is no contact, to be told
};

/// What one step leaves for the next.
struct ContactMemory {
  int count = 0;
  std::array<RowForce, kMaxRows> forces{};
  glm::dvec3 pad_s_W{0};       ///< s, sqrt(k) times the shift from tool to proxy [J^(1/2)]
  glm::dvec3 friction_s_W{0};  ///< of it what friction stretched
  double root_c = 0;           ///< of the pad's compliance c across [m/N], its root
  double stored_J = 0;         ///< |s|^2 / 2, and what rows and friction yield by themselves
};

struct ContactForces {
  spatial::Vector6 F_To_W = spatial::Vector6::Zero();   ///< of all rows on the tool, held for the step
  spatial::Vector6 V_moved = spatial::Vector6::Zero();  ///< what the tool moves with under it
  glm::dvec3 friction_shift_W{0};                       ///< friction's part of the pad's shift [m]
  PerRow kept_back_m{};  ///< by row: news that could not be afforded, recess from now on [m]
  double taken_J = 0;    ///< what tool and objects put in less what is stored: below 0, what news made
  int iterations = 0;
  bool is_solved = true;  ///< false: friction is weaker than it is
  bool is_any_saturated = false;
  bool is_news_unpaid = false;  ///< less of it was let in than there was time for
};

/// Solves one step's rows. X_WT: at its beginning. afford_J, >= 0: what news may make. memory is that of the step
/// before, and of this one after. Rows that have no namesake in it begin without friction. Bounded time, no allocation;
/// realtime-safe; cannot fail.
void solve_contacts(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility&,
                    const Law&, double afford_J, ContactMemory& memory, ContactForces&) noexcept;

}  // namespace farfeel::constraint
