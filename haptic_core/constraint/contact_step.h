// One step of the tool against rows, solved for the tool's twist and the pad. A part of contact_forces.cpp.
//
// Everything that rows do to each other goes through nine numbers, however many rows there are: the way x = h V of the
// tool within the step, and the pad's stretch s, |s|^2 / 2 its energy. Of those follow what a row pushes with and what
// friction holds,
//   l_i = clamp((d_i + g_i.x - n_i.s / sqrt(k_i)) / e_i, 0, most_i)
//   f_i = (f_i of the step before - slip_i / j_i), cut to the cone |f_i| <= mu_i l_i
//   slip_i = J_i (x - h V_S) + sqrt(c) T_i'(s - s before)
// J_i takes the tool's twist to C's velocity along T_i, two directions across n_i, and to the turning about n_i. A row
// sticks where s only takes up what the tool moves. The nine are right where
//   C^-1 (x / h - U) = F = sum J_i'f_i - g_i l_i                  the tool moves by what the rows exert
//   (s - (1 - a) s before) / a = sum n_i l_i / sqrt(k_i) + sqrt(c) T_i f_i      the pad is stretched by it
// a = h / (h + b/k): the pad is damped by its own change, and s is what it holds, without what damps. With springs of
// their own rows share no s: e_i = 1 / k_i, and j_i = 1 / k_t.
//
// Newton, with a line search on the energy of what is left over. What sticks everywhere is convex and is solved first:
// from any other start a wedge is caught at l = 0, where pushes and friction undo each other.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "haptic_core/constraint/contact_forces.h"
#include "haptic_core/constraint/mobility.h"
#include "haptic_core/constraint/row.h"

namespace farfeel::constraint {

/// For one step, on the stack. Realtime-safe; cannot fail.
class ContactStep {
 public:
  /// rows: kMaxRows at most. They, moves and memory outlive this.
  ContactStep(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility& moves,
              const Law& law, const ContactMemory& memory) noexcept;

  /// Solves with this share of the depths that are news to the pad: what nobody stretched it by. False: at its best.
  bool solve(double news_share) noexcept;

  /// What the tool and the objects have put in, less what is stored now [J]. Below 0: news pushed.
  [[nodiscard]] double taken_J() const noexcept;
  [[nodiscard]] bool has_news() const noexcept { return has_news_; }
  [[nodiscard]] int iterations() const noexcept { return iterations_; }
  [[nodiscard]] const spatial::Vector6& F_To_W() const noexcept { return F_; }
  [[nodiscard]] spatial::Vector6 V_moved() const noexcept { return y_.head<6>() / moves_.dt_s; }
  /// The recess that a row has more after this step [m].
  [[nodiscard]] double kept_back_m(int i) const noexcept {
    return across_[i].late_m + (1 - news_share_) * across_[i].news_m;
  }
  [[nodiscard]] RowForce force(int i) const noexcept;
  /// All that the next step needs, and what proxies do.
  void remember(ContactMemory& memory, ContactForces& out) const noexcept;

 private:
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  struct Across {
    Vector9 asks;                   // of l_i e_i by y
    Eigen::Matrix<double, 3, 9> B;  // of the slip by y
    Eigen::Matrix<double, 3, 2> T;
    Eigen::Vector3d slip_at_0 = Eigen::Vector3d::Zero();
    Eigen::Vector3d force_before = Eigen::Vector3d::Zero();  // of the step before
    Eigen::Vector3d force = Eigen::Vector3d::Zero();         // along T, and torsion / arm [N]
    double compliance = 0, joint = 0;                        // e_i, j_i [m/N]
    double held_m = 0, script_m = 0;                         // of d_i: what the pad holds, what the object comes
    double news_m = 0, late_m = 0;                           // the rest, and of it what is too fast
    double normal_N = 0, arm_m = 0;
    bool comes = false;  // it did not press, and now it will
    bool is_rough = false, has_slid = false, is_dragged = false;
  };
  void relax(const PerRow& felt_m, const std::array<const RowForce*, kMaxRows>& before) noexcept;
  void set_across(int i, const RowForce* before, double felt_m) noexcept;
  void hand_on_friction() noexcept;
  /// Forces of y, and what is left over, in N and J^(1/2).
  void evaluate(const Vector9& y, double friction_share) noexcept;
  [[nodiscard]] Matrix9 slope(double friction_share) const noexcept;
  [[nodiscard]] double left_over_J() const noexcept;
  [[nodiscard]] double length_of(const Vector9& way, double friction_share) noexcept;
  bool newton(double friction_share) noexcept;
  [[nodiscard]] double stored_J() const noexcept;

  std::span<const Row> rows_;
  const Mobility& moves_;
  Law law_;
  const ContactMemory& memory_;
  std::array<Across, kMaxRows> across_;
  spatial::Matrix6 inertia_;  // C^-1 / h
  double root_c_ = 0;         // of the pad's compliance across; 0 of springs
  double share_ = 1;          // a
  double news_share_ = 1;
  bool has_friction_ = false, has_news_ = false;
  int iterations_ = 0;
  Eigen::Vector3d s_before_, s_normal_, s_friction_;
  Vector9 y_, left_over_;
  spatial::Vector6 F_;
};

}  // namespace farfeel::constraint
