// The rows of one step, as the solver takes them.
//
// The tool moves with U - C (sum of g_j l_j) within the step, C = share dt A^-1. What row i asks for at the step's end
// is
//   d_i - r_i + g_i.(X - Q + h V) + (b_i/k_i) g_i.(V - V_S) <= sum_j E_ij l_j,   0 <= l_i <= most_i
// with the pad's E_ij = n_i.n_j / sqrt(k_i k_j) + e delta_ij, or delta_ij / k_i of springs. N'N / k says that the
// material yields once, however many rows report a place. Every row times its share s_i = h / (h + b_i/k_i), and E by
// the geometric mean of these:
//   H_ij = h g_i.C g_j + sqrt(s_i s_j) E_ij,   q_i = s_i (d_i - r_i + g_i.(X - Q) - (b_i/k_i) g_i.V_S) + h g_i.U
// which is symmetric but for A. For one contact it is penalty's implicit spring, k (d + h g.V),
// under backward Euler. Under the midpoint rule a row still holds at the step's end, where the tool then is.
#pragma once

#include <array>
#include <span>

#include "haptic_core/constraint/bounded_solver.h"
#include "haptic_core/constraint/row.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::constraint {

/// What the tool does within a step, and how a further wrench changes that. Both of the twist that it moves with.
struct Mobility {
  spatial::Vector6 V_free;     ///< U: without any row [rad/s, m/s]
  spatial::Matrix6 by_wrench;  ///< C, about To, in W
  double dt_s = 0;
};
[[nodiscard]] Mobility mobility(const tool::LinearStep&) noexcept;

/// From one pose to another: rotation vector, then translation, both in W.
[[nodiscard]] spatial::Vector6 way_between(const spatial::Pose& from, const spatial::Pose& to) noexcept;

struct RowProblem {
  BoundedProblem bounded;                           ///< its q is without friction and C's share of it
  std::array<double, kMaxRows> share{};             ///< s_i
  std::array<spatial::Vector6, kMaxRows> C_g;       ///< C g_i
  std::array<double, kMaxRows> depth_at_start_m{};  ///< s_i (d_i - r_i + g_i.(X - Q) - (b_i/k_i) g_i.V_S)
};

/// X_WT: at the step's beginning. The first kMaxRows of rows are taken. Realtime-safe; cannot fail.
void set_up(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility&,
            const Law&, RowProblem&) noexcept;

/// What friction holds of the pad while nothing moves.
struct HeldAcross {
  glm::dvec3 shift_W{0};  ///< c sum T f [m]
  glm::dvec3 s_W{0};      ///< sqrt(c) sum T f [J^(1/2)]
};

/// U = (|s|^2 + e l.l) / 2 at a pose [J]: what the pad stores there of what rows press, 0 <= l, and of friction;
/// without that, l.E l / 2. Realtime-safe; cannot fail.
[[nodiscard]] double pad_energy_J(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT,
                                  const Law&, const HeldAcross& held = {}) noexcept;

}  // namespace farfeel::constraint
