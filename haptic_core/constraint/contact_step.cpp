#include "haptic_core/constraint/contact_step.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace farfeel::constraint {

using Eigen::Vector3d;
using spatial::Vector6;

namespace {

/// A slide has ended once friction has to hold this much less than it did: rounding must not make it stick at every
/// step.
constexpr double kCaught = 0.9;
/// Of a patch's radius: the arm of an even pressure's friction, the mean of |r| over a disc.
constexpr double kDiscArm = 2.0 / 3;
/// j of friction that shares a pad: makes duplicates solvable. What turns 20 g at an arm of 10 mm yields 500 times as
/// much in a tick, so a change of load is found to 0.2 % at once, and held exactly where it does not change.
constexpr double kJoint_m_per_N = 1e-7;
/// What is left over is enough: 0.6 uN on 20 g at 1 kHz, 1e-17 J with the way that it moves them. Steps go on to what
/// is rounding, so that no drift is made of it.
constexpr double kEnough_J = 1e-17, kRounding_J = 1e-24;
/// Without friction 13 to 15 walls that jump need more than 30 steps, and none needed more than 60 (ContactStepTest).
constexpr int kSteps = 60, kHalvings = 8;
/// Where no part of a step leaves less, all of it is taken so often: out of a corner, where cones begin and end.
constexpr int kJumps = 4;
/// How fast news is let in: that of a tool that rests as fast as a hand does not feel it as a blow, and a texture's as
/// its slope, at most 1, comes with the tool's way.
constexpr double kNews_N_per_s = 100, kNewsPerWay = 1;
/// What holds everything.
constexpr double kSticks = 1e9;
/// Of the slope at the beginning of a way: so little left is flat.
constexpr double kFlat = 0.3;

const RowForce* find(const ContactMemory& memory, std::uint64_t name) noexcept {
  for (int i = 0; i < memory.count; ++i)
    if (memory.forces[i].name == name) return &memory.forces[i];
  return nullptr;
}

/// A mean over the rows that pressed in the step before, by what they pressed; else over all.
template <typename Of>
double mean(std::span<const Row> rows, const std::array<const RowForce*, kMaxRows>& before, const Of& of) noexcept {
  double weights_N = 0, weighed = 0, sum = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double weight_N = before[i] ? before[i]->normal_N : 0;
    weights_N += weight_N;
    weighed += weight_N * of(rows[i]);
    sum += of(rows[i]);
  }
  return weights_N > 0 ? weighed / weights_N : sum / static_cast<double>(std::max<std::size_t>(rows.size(), 1));
}

double share_of(const Row& row, double dt_s) noexcept {
  return dt_s / (dt_s + row.damping_Ns_per_m / row.stiffness_N_per_m);
}

}  // namespace

ContactStep::ContactStep(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT,
                         const Mobility& moves, const Law& law, const ContactMemory& memory) noexcept
    : rows_(rows), moves_(moves), law_(law), memory_(memory), inertia_(moves.by_wrench.inverse() / moves.dt_s) {
  std::array<const RowForce*, kMaxRows> before{};
  bool is_any_known = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    before[i] = find(memory, rows[i].name);
    is_any_known = is_any_known || before[i];
  }
  // What vanished leaves its share of s to those that stay; where all are new, nothing of it is left.
  s_before_ = is_any_known ? spatial::to_eigen(memory.pad_s_W) : Vector3d(Vector3d::Zero());
  if (law.pad == Pad::kOne) {
    root_c_ = std::sqrt(mean(rows, before, [](const Row& row) { return 1 / row.stiffness_N_per_m; }));
    share_ = mean(rows, before, [&](const Row& row) { return share_of(row, moves.dt_s); });
  }
  const Vector6 way = way_between(X_WQ, X_WT);
  PerRow felt_m;
  for (std::size_t i = 0; i < rows.size(); ++i)
    felt_m[i] = rows[i].depth_m - rows[i].recess_m + rows[i].gradient.dot(way);
  if (law.pad == Pad::kOne) relax(felt_m, before);
  for (std::size_t i = 0; i < rows.size(); ++i) set_across(static_cast<int>(i), before[i], felt_m[i]);
  hand_on_friction();
  y_ << moves.dt_s * moves.V_free, s_before_;
}

/// Where all that pressed has become less deep, the pad is as much less stretched before the tool moves. Only what the
/// tool does is damped: a surface that falls faster than a damped pad follows would leave the tool.
void ContactStep::relax(const PerRow& felt_m, const std::array<const RowForce*, kMaxRows>& before) noexcept {
  double left = 0;
  for (std::size_t i = 0; i < rows_.size() && left < 1; ++i) {
    const Row& row = rows_[i];
    const double pushed_N = before[i] ? before[i]->normal_N : 0;
    const double asks_m =
        felt_m[i] + moves_.dt_s * row.gradient.dot(row.V_WS_W) - law_.row_compliance_m_per_N * pushed_N;
    const double held_m = spatial::to_eigen(row.nhat_ST_W).dot(s_before_) / std::sqrt(row.stiffness_N_per_m);
    if (asks_m > 0) left = held_m > asks_m ? std::max(left, asks_m / held_m) : 1;
  }
  const Vector3d less = s_before_ - (1 - left) * (s_before_ - spatial::to_eigen(memory_.friction_s_W));
  if (less.norm() < s_before_.norm()) s_before_ = less;
}

/// felt_m: at the step's beginning, with the object where it will be at its end.
void ContactStep::set_across(int i, const RowForce* before, double felt_m) noexcept {
  const Row& row = rows_[i];
  Across& a = across_[i];
  const bool is_one_pad = law_.pad == Pad::kOne;
  const double h = moves_.dt_s;
  const Vector3d n = spatial::to_eigen(row.nhat_ST_W);
  const Vector3d yields = (is_one_pad ? 1 / std::sqrt(row.stiffness_N_per_m) : 0) * n;
  a.asks << row.gradient, -yields;
  a.script_m = -h * row.gradient.dot(row.V_WS_W);
  if (is_one_pad) {
    a.compliance = law_.row_compliance_m_per_N;
    a.held_m = yields.dot(s_before_) + a.compliance * (before ? before->normal_N : 0);
    const double news_m = std::max(0.0, felt_m - a.script_m - a.held_m);
    const Vector3d v_WC = moves_.V_begun.tail<3>() + moves_.V_begun.head<3>().cross(spatial::to_eigen(row.p_ToC_W));
    a.news_m = std::min(news_m, h * (kNews_N_per_s / row.stiffness_N_per_m + kNewsPerWay * v_WC.norm()));
    a.late_m = news_m - a.news_m;
    has_news_ = has_news_ || a.news_m > 0;
    a.held_m = felt_m - a.script_m - news_m;
  } else {
    // A spring's damper is its own: l = k (d + g.x) + b g.(x / h - V_S).
    const double share = share_of(row, h), lag_s = row.damping_Ns_per_m / row.stiffness_N_per_m;
    a.compliance = share / row.stiffness_N_per_m;
    a.held_m = share * (felt_m - lag_s * row.gradient.dot(row.V_WS_W));
    a.script_m = 0;
  }
  if (before) a.normal_N = before->normal_N;
  a.comes = !(a.normal_N > 0) && a.news_m + a.late_m > 0;

  a.is_rough = row.dynamic_friction > 0 || row.static_friction > 0;
  if (!a.is_rough) return;
  has_friction_ = true;
  a.joint = is_one_pad ? kJoint_m_per_N : 1 / (law_.tangential_share * row.stiffness_N_per_m);
  const glm::dquat R_WC = spatial::frame_with_z(row.nhat_ST_W);
  a.T.col(0) = spatial::to_eigen(R_WC * glm::dvec3(1, 0, 0));
  a.T.col(1) = spatial::to_eigen(R_WC * glm::dvec3(0, 1, 0));
  a.arm_m = kDiscArm * row.patch_radius_m;
  a.B.setZero();
  a.B.topLeftCorner<2, 3>() = -a.T.transpose() * spatial::cross_matrix(row.p_ToC_W);
  a.B.block<2, 3>(0, 3) = a.T.transpose();
  a.B.bottomLeftCorner<1, 3>() = a.arm_m * n.transpose();
  a.B.topRightCorner<2, 3>() = root_c_ * a.T.transpose();
  a.slip_at_0 = -h * (a.B.leftCols<6>() * row.V_WS_W);
  a.slip_at_0 -= a.B.rightCols<3>() * s_before_;
  if (!before) return;
  a.force_before.head<2>() = a.T.transpose() * spatial::to_eigen(before->friction_W);
  a.force_before.z() = a.arm_m > 0 ? before->torsion_Nm / a.arm_m : 0;
  a.has_slid = before->is_sliding;
}

/// What vanished held, the others go on to hold, and all the same stretch of s, whatever c has become. What comes where
/// the pad is pressed takes its share, as if it pressed like the mean: else the others, relieved of their pushes, would
/// slip by what joints yield.
void ContactStep::hand_on_friction() noexcept {
  double pressed_N = 0;
  int pressing = 0, coming = 0;
  Vector3d held = Vector3d::Zero(), goes_on = Vector3d::Zero();
  for (int i = 0; i < memory_.count; ++i) held += spatial::to_eigen(memory_.forces[i].friction_W);
  const std::span across(across_.data(), rows_.size());
  for (const Across& a : across) {
    if (!a.is_rough) continue;
    pressed_N += a.normal_N;
    pressing += a.normal_N > 0;
    coming += a.comes;
  }
  if (!(root_c_ > 0 && pressed_N > 0)) return;
  held *= memory_.root_c / root_c_;
  const double each_N = pressed_N / pressing, all_N = pressed_N + coming * each_N;
  for (Across& a : across) {
    if (!a.is_rough) continue;
    a.force_before *= pressed_N / all_N;
    goes_on += a.T * a.force_before.head<2>();
  }
  for (Across& a : across)
    if (a.is_rough)
      a.force_before.head<2>() += (a.comes ? each_N : a.normal_N) / all_N * (a.T.transpose() * (held - goes_on));
}

void ContactStep::evaluate(const Vector9& y, double friction_share) noexcept {
  F_.setZero();
  s_normal_.setZero();
  s_friction_.setZero();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Across& a = across_[i];
    const double depth_m = a.held_m + a.script_m + news_share_ * a.news_m + a.asks.dot(y);
    a.normal_N = std::clamp(depth_m / a.compliance, 0.0, rows_[i].most_N);
    F_ -= a.normal_N * rows_[i].gradient;
    s_normal_ -= a.normal_N * a.asks.tail<3>();
    if (!a.is_rough) continue;
    const double dynamic_N = friction_share * rows_[i].dynamic_friction * a.normal_N;
    const double static_N = friction_share * rows_[i].static_friction * a.normal_N;
    const double hold_N = a.has_slid || a.is_dragged ? dynamic_N : std::max(static_N, dynamic_N);
    a.force = a.force_before - (a.slip_at_0 + a.B * y) / a.joint;
    if (const double N = a.force.norm(); N > hold_N) a.force *= dynamic_N / N;
    F_ += a.B.leftCols<6>().transpose() * a.force;
    s_friction_ += a.B.rightCols<3>().transpose() * a.force;
  }
  left_over_.head<6>() = inertia_ * (y.head<6>() - moves_.dt_s * moves_.V_free) - F_;
  left_over_.tail<3>() = (y.tail<3>() - (1 - share_) * s_before_) / share_ - s_normal_ - s_friction_;
}

/// Of what is left over, by y, where evaluate() was last.
ContactStep::Matrix9 ContactStep::slope(double friction_share) const noexcept {
  Matrix9 slope = Matrix9::Zero();
  slope.topLeftCorner<6, 6>() = inertia_;
  slope.bottomRightCorner<3, 3>().diagonal().setConstant(1 / share_);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Across& a = across_[i];
    const bool is_free = a.normal_N > 0 && a.normal_N < rows_[i].most_N;
    if (is_free) slope.noalias() += (a.asks / a.compliance) * a.asks.transpose();
    if (!a.is_rough || !(a.normal_N > 0)) continue;
    const double most_N = a.force.norm();
    const Vector3d wanted = a.force_before - (a.slip_at_0 + a.B * y_) / a.joint;
    const double wanted_N = wanted.norm();
    if (!(wanted_N > most_N * (1 + 1e-12))) {
      slope.noalias() += a.B.transpose() * (a.B / a.joint);
      continue;
    }
    const Vector3d along = wanted / wanted_N;
    const Eigen::Matrix<double, 3, 9> turns = a.B - along * (along.transpose() * a.B);
    slope.noalias() += (most_N / wanted_N / a.joint) * (a.B.transpose() * turns);
    if (is_free)
      slope.noalias() -=
          (friction_share * rows_[i].dynamic_friction / a.compliance) * (a.B.transpose() * along) * a.asks.transpose();
  }
  return slope;
}

double ContactStep::left_over_J() const noexcept {
  const Vector6 F = left_over_.head<6>();
  return 0.5 * (F.dot(moves_.dt_s * (moves_.by_wrench * F)) + share_ * left_over_.tail<3>().squaredNorm());
}

/// How far to go along a way on which the energy is convex: its slope there, way.left_over, only falls. To where not
/// much of it is left, by false position.
double ContactStep::length_of(const Vector9& way, double friction_share) noexcept {
  const double falls = way.dot(left_over_);
  double length = 1, low = 0, at_low = falls, high = 0, at_high = 0;
  for (int trial = 0; trial <= kHalvings; ++trial) {
    evaluate(y_ - length * way, friction_share);
    const double slope = way.dot(left_over_);
    if (std::abs(slope) <= kFlat * falls || (trial == 0 && slope >= 0)) return length;
    (slope > 0 ? low : high) = length, (slope > 0 ? at_low : at_high) = slope;
    length = low + (high - low) * std::clamp(at_low / (at_low - at_high), 0.1, 0.9);
  }
  return low > 0 ? low : length;
}

bool ContactStep::newton(double friction_share) noexcept {
  int jumped = 0;
  const bool is_convex = friction_share == 0 || friction_share == kSticks;
  evaluate(y_, friction_share);
  double left_J = left_over_J();
  for (int step = 0; step < kSteps && left_J > kRounding_J; ++step, ++iterations_) {
    const Vector9 way = slope(friction_share).partialPivLu().solve(left_over_);
    double length = 1, then_J = 0;
    if (is_convex) {
      length = length_of(way, friction_share);
      evaluate(y_ - length * way, friction_share);
      then_J = left_over_J();
      if (left_J <= kEnough_J && !(then_J < left_J)) break;
    } else {
      for (int halving = 0; halving <= kHalvings; ++halving, length *= 0.5) {
        evaluate(y_ - length * way, friction_share);
        then_J = left_over_J();
        if (then_J < left_J * (1 - 0.1 * length)) break;
      }
      if (!(then_J < left_J)) {
        if (left_J <= kEnough_J || ++jumped > kJumps) break;
        length = 1;
        evaluate(y_ - way, friction_share);
        then_J = left_over_J();
      }
    }
    y_ -= length * way;
    left_J = then_J;
    if (friction_share != 1) continue;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      Across& a = across_[i];
      if (!a.is_rough || a.is_dragged) continue;
      const double N = (a.force_before - (a.slip_at_0 + a.B * y_) / a.joint).norm();
      a.is_dragged = N > a.force.norm() * (1 + 1e-12);
    }
  }
  evaluate(y_, friction_share);
  return left_over_J() <= kEnough_J;
}

bool ContactStep::solve(double news_share) noexcept {
  news_share_ = news_share;
  for (Across& a : across_) a.is_dragged = a.has_slid;
  y_ << moves_.dt_s * moves_.V_free, s_before_;
  if (!has_friction_) return newton(0);
  const bool does_stick = newton(kSticks);
  if (does_stick && newton(1)) return true;
  y_ << moves_.dt_s * moves_.V_free, s_before_;
  Vector9 best = y_;
  double best_share = 0;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    if (newton(share)) best = y_, best_share = share;
  }
  y_ = best;
  evaluate(y_, best_share);
  return best_share == 1;
}

double ContactStep::stored_J() const noexcept {
  double twice_J = law_.pad == Pad::kOne ? y_.tail<3>().squaredNorm() : 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Across& a = across_[i];
    twice_J += a.compliance * a.normal_N * a.normal_N;
    if (a.is_rough) twice_J += a.joint * a.force.squaredNorm();
  }
  return 0.5 * twice_J;
}

double ContactStep::taken_J() const noexcept {
  double taken_J = memory_.stored_J - stored_J() - F_.dot(y_.head<6>());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Across& a = across_[i];
    Vector6 F = -a.normal_N * rows_[i].gradient;
    if (a.is_rough) F += a.B.leftCols<6>().transpose() * a.force;
    taken_J += moves_.dt_s * F.dot(rows_[i].V_WS_W);
  }
  return taken_J;
}

RowForce ContactStep::force(int i) const noexcept {
  const Across& a = across_[i];
  RowForce force;
  force.name = rows_[i].name;
  force.normal_N = a.normal_N;
  force.is_saturated = rows_[i].most_N > 0 && a.normal_N >= rows_[i].most_N;
  if (!a.is_rough) return force;
  force.friction_W = spatial::to_glm(a.T * a.force.head<2>());
  force.torsion_Nm = a.arm_m * a.force.z();
  const double caught_N = kCaught * rows_[i].dynamic_friction * force.normal_N;
  const double wanted_N = (a.force_before - (a.slip_at_0 + a.B * y_) / a.joint).norm();
  const bool is_cut = wanted_N > a.force.norm() * (1 + 1e-12);
  force.is_sliding = force.normal_N > 0 && (is_cut || (a.has_slid && a.force.norm() >= caught_N));
  return force;
}

void ContactStep::remember(ContactMemory& memory, ContactForces& out) const noexcept {
  const double stored_after_J = stored_J();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    memory.forces[i] = force(static_cast<int>(i));
    out.kept_back_m[i] = kept_back_m(static_cast<int>(i));
    out.is_any_saturated = out.is_any_saturated || memory.forces[i].is_saturated;
  }
  memory.count = static_cast<int>(rows_.size());
  memory.pad_s_W = spatial::to_glm(y_.tail<3>());
  memory.friction_s_W = share_ * spatial::to_glm(s_friction_) + (1 - share_) * memory.friction_s_W;
  memory.root_c = root_c_;
  memory.stored_J = stored_after_J;
  out.friction_shift_W = root_c_ * memory.friction_s_W;
}

}  // namespace farfeel::constraint
