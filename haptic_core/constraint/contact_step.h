// The forces of one step's rows, while they are solved. A part of contact_forces.cpp.
//
// Unknown are l_i, a row's push, and f_i, its friction along T_i, two directions across n_i, and about n_i. Everything
// that they do to each other goes through nine numbers, however many rows there are: the tool's twist V, and the pad's
// s,
//   V = U + C (sum -g_j l_j + J_j' f_j),   s = sum n_j l_j / sqrt(k_j) + sqrt(c) T_j f_j,   |s|^2 / 2 is the pad's
//   energy. push i:      h g_i.V - s_i n_i.s / sqrt(k_i) - s_i e l_i + start_i <= 0, 0 <= l_i (row_problem.h) friction
//   i:  slip = J_i (h V - h V_S) + sqrt(c) T_i'(s - s of the step before), 0 or against f_i, |f_i| in its cone
// J_i takes the tool's twist to C's velocity along T_i, and to the turning about n_i. A row sticks where s only takes
// up what the tool moves: at rest it is held by the same s as before, so nothing creeps, whatever c has become
// meanwhile.
//
// push() solves all l with f as it is. drag() solves f row by row (Gauss-Seidel), exactly in each block and in the cone
// of l. Both by turns converge slowly where rows share the pad or jam: what turns four corners shifts no pad, and
// between two walls l and f undo each other. So hold() first solves all rows that stick and push together. With B_i of
// nine columns
//   (E + L D R') y = r,   D = diag(h C, 1):   (I + R'E^-1 L D) z = R'E^-1 r,   y = E^-1 (r - L D z).
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "haptic_core/constraint/bounded_solver.h"
#include "haptic_core/constraint/contact_forces.h"
#include "haptic_core/constraint/row.h"
#include "haptic_core/constraint/row_problem.h"

namespace farfeel::constraint {

/// For one step, on the stack. Realtime-safe; cannot fail.
class ContactStep {
 public:
  /// rows: kMaxRows at most. They, moves and memory outlive this.
  ContactStep(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility& moves,
              const Law& law, const ContactMemory& memory) noexcept;

  [[nodiscard]] bool has_friction() const noexcept { return has_friction_; }
  SolveFigures push() noexcept;
  void hold() noexcept;
  /// What this step would make, being not quite solved [J]. Not above rounding where friction is none, after push().
  [[nodiscard]] double made_J() const noexcept;
  /// Friction becomes a share of what it is. Then push().
  void weaken(double share) noexcept;
  /// Whether a row has begun to slide: others may take over what it no longer holds.
  bool drag() noexcept;

  [[nodiscard]] const BoundedAnswer& normal() const noexcept { return normal_; }
  [[nodiscard]] const spatial::Vector6& V_moved() const noexcept { return V_; }
  [[nodiscard]] spatial::Vector6 F_To_W() const noexcept { return F_normal_ + F_friction_; }
  [[nodiscard]] Eigen::Vector3d friction_shift_W() const noexcept { return root_c_ * s_friction_; }  ///< [m]
  [[nodiscard]] Eigen::Vector3d s_W() const noexcept { return s_normal_ + s_friction_; }             ///< [J^(1/2)]
  /// w_i, over its share [m].
  [[nodiscard]] double slack_m(std::size_t i) const noexcept;
  [[nodiscard]] RowForce force(int i) const noexcept;

 private:
  struct Across {
    Eigen::Matrix<double, 3, 6> J;
    Eigen::Matrix<double, 6, 3> C_Jt;
    Eigen::Matrix<double, 3, 2> T;
    Eigen::Matrix3d W, W_inverse;  // of the block; without a patch the third axis is 1, and nothing drives it
    Eigen::Vector3d force = Eigen::Vector3d::Zero();         // along T, and torsion / arm [N]
    Eigen::Vector3d force_before = Eigen::Vector3d::Zero();  // of the step before
    double arm_m = 0, own = 0;  // own: what yields across n [m/N], the pad's c or the row's spring
    bool is_rough = false, has_slid = false, is_dragged = false;
  };
  void set_across(int i, const RowForce* before) noexcept;
  void sum_normals() noexcept;
  [[nodiscard]] Eigen::Vector3d slip(int i) const noexcept;
  void add_friction(int i, const Eigen::Vector3d& more) noexcept;
  [[nodiscard]] double asked_m(std::size_t i, const spatial::Vector6& V_without_pushes) const noexcept;

  std::span<const Row> rows_;
  const Mobility& moves_;
  Law law_;
  RowProblem problem_;
  BoundedAnswer normal_;
  std::array<Across, kMaxRows> across_;
  std::array<Eigen::Vector3d, kMaxRows> yields_;  // n_i / sqrt(k_i); 0 of springs
  PerRow slack_before_m_{};
  bool has_friction_ = false;
  double root_c_ = 0;  // of the pad's compliance across; 0 of springs
  Eigen::Vector3d s_before_, s_normal_, s_friction_ = Eigen::Vector3d::Zero();
  spatial::Vector6 V_, F_normal_, F_friction_ = spatial::Vector6::Zero();
};

}  // namespace farfeel::constraint
