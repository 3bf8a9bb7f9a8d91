#include "haptic_core/constraint/row_problem.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace farfeel::constraint {

using spatial::Vector6;

namespace {

int counted(std::span<const Row> rows) noexcept {
  return static_cast<int>(std::min<std::size_t>(rows.size(), kMaxRows));
}

/// E times the rows' scales: E_ij s_i s_j.
void add_pad(std::span<const Row> rows, const Law& law, const PerRow& scale, BoundedProblem& problem) noexcept {
  std::array<glm::dvec3, kMaxRows> yields;  // s_i n_i / sqrt(k_i)
  for (int i = 0; i < problem.count; ++i) {
    const double k = rows[i].stiffness_N_per_m;
    yields[i] = scale[i] / std::sqrt(k) * rows[i].nhat_ST_W;
    if (law.pad == Pad::kOne)
      for (int j = 0; j < i; ++j) {
        const double E = glm::dot(yields[i], yields[j]);
        problem.H[i][j] += E;
        problem.H[j][i] += E;
      }
    problem.H[i][i] += scale[i] * scale[i] * (1 / k + law.row_compliance_m_per_N);
  }
}

}  // namespace

Mobility mobility(const tool::LinearStep& step) noexcept {
  const spatial::Matrix6 inverse = step.A.partialPivLu().inverse();
  return {step.V_begun + step.share * (inverse * step.impulse), step.share * step.dt_s * inverse, step.dt_s};
}

Vector6 way_between(const spatial::Pose& from, const spatial::Pose& to) noexcept {
  Vector6 way;
  way << spatial::to_eigen(spatial::vector_from_rotation(to.R * glm::conjugate(from.R))),
      spatial::to_eigen(to.p - from.p);
  return way;
}

void set_up(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Mobility& moves,
            const Law& law, RowProblem& problem) noexcept {
  BoundedProblem& bounded = problem.bounded;
  bounded.count = counted(rows);
  const Vector6 way = way_between(X_WQ, X_WT);
  const double h = moves.dt_s;
  for (int i = 0; i < bounded.count; ++i) {
    const Row& row = rows[i];
    const Vector6& g = row.gradient;
    const double lag_s = row.damping_Ns_per_m / row.stiffness_N_per_m;
    problem.share[i] = h / (h + lag_s);
    problem.C_g[i] = moves.by_wrench * g;
    problem.depth_at_start_m[i] =
        problem.share[i] * (row.depth_m - row.recess_m + g.dot(way) - lag_s * g.dot(row.V_WS_W));
    bounded.q[i] = problem.depth_at_start_m[i] + h * g.dot(moves.V_free);
    bounded.most[i] = row.most_N;
  }
  PerRow root_share;
  for (int i = 0; i < bounded.count; ++i) {
    root_share[i] = std::sqrt(problem.share[i]);
    const Vector6 h_g = h * rows[i].gradient;
    for (int j = 0; j < bounded.count; ++j) bounded.H[i][j] = h_g.dot(problem.C_g[j]);
  }
  add_pad(rows, law, root_share, bounded);
}

double pad_energy_J(std::span<const Row> rows, const spatial::Pose& X_WQ, const spatial::Pose& X_WT, const Law& law,
                    const HeldAcross& held) noexcept {
  BoundedProblem problem;
  problem.count = counted(rows);
  const Vector6 way = way_between(X_WQ, X_WT);
  for (int i = 0; i < problem.count; ++i) {
    problem.q[i] =
        rows[i].depth_m - rows[i].recess_m + rows[i].gradient.dot(way) - glm::dot(rows[i].nhat_ST_W, held.shift_W);
    problem.most[i] = rows[i].most_N;
    for (int j = 0; j < problem.count; ++j) problem.H[i][j] = 0;
  }
  PerRow ones;
  ones.fill(1);
  add_pad(rows, law, ones, problem);
  BoundedAnswer answer;
  (void)solve_bounded(problem, answer);
  double twice_J = glm::dot(held.s_W, held.s_W);
  for (int i = 0; i < problem.count; ++i)
    for (int j = 0; j < problem.count; ++j) twice_J += answer.lambda[i] * problem.H[i][j] * answer.lambda[j];
  for (int i = 0; i < problem.count && law.pad == Pad::kOne; ++i)
    twice_J += 2 * answer.lambda[i] / std::sqrt(rows[i].stiffness_N_per_m) * glm::dot(rows[i].nhat_ST_W, held.s_W);
  return 0.5 * twice_J;
}

}  // namespace farfeel::constraint
