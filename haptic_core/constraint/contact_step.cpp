#include "haptic_core/constraint/contact_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "haptic_core/constraint/friction_block.h"

namespace farfeel::constraint {

using Eigen::Vector3d;
using spatial::Vector6;

namespace {

/// A slide has ended once friction has to hold this much less than it did: rounding must not make it stick at every
/// step.
constexpr double kCaught = 0.9;
/// Of a patch's radius: the arm of an even pressure's friction, the mean of |r| over a disc.
constexpr double kDiscArm = 2.0 / 3;
/// E of friction that shares a pad: makes duplicates solvable. What turns 20 g at an arm of 10 mm yields 500 times as
/// much in a tick, so a change of load is found to 0.2 % at once, and held exactly where it does not change.
constexpr double kJoint_m_per_N = 1e-7;

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Columns = Eigen::Matrix<double, 3, 9>;

const RowForce* find(const ContactMemory& memory, std::uint64_t name) noexcept {
  for (int i = 0; i < memory.count; ++i)
    if (memory.forces[i].name == name) return &memory.forces[i];
  return nullptr;
}

/// c: of the rows that pressed in the step before, by what they pressed; else of all.
double pad_compliance(std::span<const Row> rows, const std::array<const RowForce*, kMaxRows>& before) noexcept {
  double weights_N = 0, weighed = 0, sum = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double weight_N = before[i] ? before[i]->normal_N : 0;
    weights_N += weight_N;
    weighed += weight_N / rows[i].stiffness_N_per_m;
    sum += 1 / rows[i].stiffness_N_per_m;
  }
  return weights_N > 0 ? weighed / weights_N : sum / static_cast<double>(std::max<std::size_t>(rows.size(), 1));
}

}  // namespace

ContactStep::ContactStep(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT,
                         const Mobility& moves, const Law& law, const ContactMemory& memory) noexcept
    : rows_(rows), moves_(moves), law_(law) {
  set_up(rows, X_WQ, X_WT, moves, law, problem_);
  std::array<const RowForce*, kMaxRows> before{};
  bool is_any_known = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    before[i] = find(memory, rows[i].name);
    is_any_known = is_any_known || before[i];
    const double normal_N = before[i] ? std::clamp(before[i]->normal_N, 0.0, rows[i].most_N) : 0;
    normal_.lambda[i] = normal_N;
    slack_before_m_[i] = before[i] ? before[i]->slack_m : 0;
    normal_.bound[i] = !(normal_N > 0) ? Bound::kZero : normal_N < rows[i].most_N ? Bound::kFree : Bound::kMost;
  }
  const bool is_one_pad = law.pad == Pad::kOne;
  if (is_one_pad) root_c_ = std::sqrt(pad_compliance(rows, before));
  // What vanished leaves its share of s to those that stay; where all are new, nothing of it is left.
  s_before_ = is_any_known ? spatial::to_eigen(memory.pad_s_W) : Vector3d(Vector3d::Zero());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    yields_[i] = (is_one_pad ? 1 / std::sqrt(rows[i].stiffness_N_per_m) : 0) * spatial::to_eigen(rows[i].nhat_ST_W);
    set_across(static_cast<int>(i), before[i]);
  }
}

void ContactStep::set_across(int i, const RowForce* before) noexcept {
  const Row& row = rows_[i];
  Across& a = across_[i];
  a.is_rough = row.dynamic_friction > 0 || row.static_friction > 0;
  if (!a.is_rough) return;
  has_friction_ = true;
  a.own = law_.pad == Pad::kOne ? root_c_ * root_c_ : 1 / (law_.tangential_share * row.stiffness_N_per_m);
  const glm::dquat R_WC = spatial::frame_with_z(row.nhat_ST_W);
  a.T.col(0) = spatial::to_eigen(R_WC * glm::dvec3(1, 0, 0));
  a.T.col(1) = spatial::to_eigen(R_WC * glm::dvec3(0, 1, 0));
  a.arm_m = kDiscArm * row.patch_radius_m;
  a.J.setZero();
  a.J.topLeftCorner<2, 3>() = -a.T.transpose() * spatial::cross_matrix(row.p_ToC_W);
  a.J.topRightCorner<2, 3>() = a.T.transpose();
  a.J.bottomLeftCorner<1, 3>() = a.arm_m * spatial::to_eigen(row.nhat_ST_W).transpose();
  a.C_Jt = moves_.by_wrench * a.J.transpose();
  a.W = moves_.dt_s * a.J * a.C_Jt;
  a.W = (0.5 * (a.W + a.W.transpose())).eval();
  a.W.topLeftCorner<2, 2>() += a.own * Eigen::Matrix2d::Identity();
  if (!(a.arm_m > 0)) a.W(2, 2) = 1;
  a.W_inverse = a.W.inverse();
  if (!before) return;
  a.force.head<2>() = a.T.transpose() * spatial::to_eigen(before->friction_W);
  a.force.z() = a.arm_m > 0 ? before->torsion_Nm / a.arm_m : 0;
  a.force_before = a.force;
  a.has_slid = a.is_dragged = before->is_sliding;
  F_friction_ += a.J.transpose() * a.force;
  s_friction_ += root_c_ * (a.T * a.force.head<2>());
}

/// q_i with friction as it is.
double ContactStep::asked_m(std::size_t i, const Vector6& V_without_pushes) const noexcept {
  return problem_.depth_at_start_m[i] + moves_.dt_s * rows_[i].gradient.dot(V_without_pushes) -
         problem_.share[i] * yields_[i].dot(s_friction_);
}

SolveFigures ContactStep::push() noexcept {
  const Vector6 V = has_friction_ ? Vector6(moves_.V_free + moves_.by_wrench * F_friction_) : moves_.V_free;
  for (std::size_t i = 0; i < rows_.size(); ++i) problem_.bounded.q[i] = asked_m(i, V);
  const SolveFigures figures = solve_bounded(problem_.bounded, normal_);
  sum_normals();
  return figures;
}

double ContactStep::slack_m(std::size_t i) const noexcept {
  // A row at its most pushes less than is asked for, which makes nothing.
  if (normal_.bound[i] != Bound::kFree) return 0;
  double w = -asked_m(i, moves_.V_free + moves_.by_wrench * F_friction_);
  for (std::size_t j = 0; j < rows_.size(); ++j) w += problem_.bounded.H[i][j] * normal_.lambda[j];
  return w / problem_.share[i];
}

double ContactStep::made_J() const noexcept {
  double made_J = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!(normal_.lambda[i] > 0)) continue;
    made_J += normal_.lambda[i] * (slack_m(i) - slack_before_m_[i]);
    if (across_[i].is_rough) made_J += across_[i].force.dot(slip(static_cast<int>(i)));
  }
  return made_J;
}

void ContactStep::weaken(double share) noexcept {
  F_friction_ *= share;
  s_friction_ *= share;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!across_[i].is_rough) continue;
    across_[i].force *= share;
    across_[i].is_dragged = true;
  }
}

void ContactStep::sum_normals() noexcept {
  F_normal_.setZero();
  s_normal_.setZero();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    F_normal_ -= normal_.lambda[i] * rows_[i].gradient;
    s_normal_ += normal_.lambda[i] * yields_[i];
  }
  V_ = moves_.V_free + moves_.by_wrench * (F_normal_ + F_friction_);
}

Vector3d ContactStep::slip(int i) const noexcept {
  const Across& a = across_[i];
  Vector3d slip = moves_.dt_s * (a.J * (V_ - rows_[i].V_WS_W));
  if (law_.pad == Pad::kOne) {
    slip.head<2>() += root_c_ * (a.T.transpose() * (s_normal_ + s_friction_ - s_before_));
  } else {
    slip.head<2>() += a.own * (a.force - a.force_before).head<2>();
  }
  return slip;
}

void ContactStep::add_friction(int i, const Vector3d& more) noexcept {
  Across& a = across_[i];
  a.force += more;
  F_friction_ += a.J.transpose() * more;
  V_ += a.C_Jt * more;
  s_friction_ += root_c_ * (a.T * more.head<2>());
}

void ContactStep::hold() noexcept {
  std::array<int, kMaxRows> held;
  int count = 0;
  for (int i = 0; i < static_cast<int>(rows_.size()); ++i)
    if (across_[i].is_rough && !across_[i].is_dragged && normal_.lambda[i] > 0) held[count++] = i;
  if (count < 2) return;  // one block is exact by itself

  const auto columns = [&](const Across& a) {
    Columns B = Columns::Zero();
    B.leftCols<6>() = a.J;
    B.topRightCorner<2, 3>() = root_c_ * a.T.transpose();
    return B;
  };
  const auto stiff = [&](const Across& a) { return 1 / (law_.pad == Pad::kOne ? kJoint_m_per_N : a.own); };
  Matrix9 gram = Matrix9::Zero();  // B'E^-1 B
  Vector9 right = Vector9::Zero();
  std::array<Vector3d, kMaxRows> slips;
  for (int k = 0; k < count; ++k) {
    const Across& a = across_[held[k]];
    const Columns B = columns(a);
    slips[k] = slip(held[k]);
    gram += stiff(a) * (B.transpose() * B);
    right -= stiff(a) * (B.transpose() * slips[k]);
  }
  Matrix9 D = Matrix9::Identity();
  D.topLeftCorner<6, 6>() = moves_.dt_s * moves_.by_wrench;
  const Vector9 Dz = D * Matrix9(Matrix9::Identity() + gram * D).partialPivLu().solve(right);
  for (int k = 0; k < count; ++k) {
    const Across& a = across_[held[k]];
    add_friction(held[k], -stiff(a) * (slips[k] + columns(a) * Dz));
  }
}

bool ContactStep::drag() noexcept {
  bool has_begun = false;
  for (int i = 0; i < static_cast<int>(rows_.size()); ++i) {
    Across& a = across_[i];
    if (!a.is_rough) continue;
    const double dynamic_N = rows_[i].dynamic_friction * normal_.lambda[i];
    const double hold_N = a.has_slid ? dynamic_N : std::max(rows_[i].static_friction * normal_.lambda[i], dynamic_N);
    const Vector3d holding = a.force - a.W_inverse * slip(i);
    const bool was_dragged = a.is_dragged;
    a.is_dragged = !(holding.squaredNorm() <= hold_N * hold_N);
    has_begun = has_begun || (a.is_dragged && !was_dragged && hold_N > 0);
    Vector3d force = holding;
    if (a.is_dragged) {
      const Vector3d b = a.W * holding;
      if (a.arm_m > 0) {
        force = dragging_force<3>(a.W, b, dynamic_N);
      } else {
        force << dragging_force<2>(a.W.topLeftCorner<2, 2>(), b.head<2>(), dynamic_N), 0;
      }
    }
    add_friction(i, force - a.force);
  }
  return has_begun;
}

RowForce ContactStep::force(int i) const noexcept {
  RowForce force;
  force.name = rows_[i].name;
  force.normal_N = normal_.lambda[i];
  force.is_saturated = normal_.bound[i] == Bound::kMost && rows_[i].most_N > 0;
  const Across& a = across_[i];
  if (has_friction_) force.slack_m = slack_m(static_cast<std::size_t>(i));
  if (!a.is_rough) return force;
  force.friction_W = spatial::to_glm(a.T * a.force.head<2>());
  force.torsion_Nm = a.arm_m * a.force.z();
  const double caught_N = kCaught * rows_[i].dynamic_friction * force.normal_N;
  force.is_sliding = force.normal_N > 0 && (a.is_dragged || (a.has_slid && a.force.norm() >= caught_N));
  return force;
}

}  // namespace farfeel::constraint
