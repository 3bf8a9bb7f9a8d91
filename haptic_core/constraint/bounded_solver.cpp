// Of the symmetric part S: free rows F, in the order in which they became free, have the factor L L' = S_FF. A row that
// becomes free appends a row to L; one that meets a bound leaves, and L is made anew from its place on. The free rows'
// target z solves S_FF z = q_F - S_FM most_M. The step l_F <- l_F + t (z - l_F) ends at the first bound, t <= 1.
//
// Which row is let go: that with the greatest violation over sqrt(S_ii), the distance in the metric of H, so that a
// row's unit does not count.
#include "haptic_core/constraint/bounded_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace farfeel::constraint {
namespace {

/// Conditions that hold to this hold: of the greatest |q|, and of what all forces together take off a row. Opposed rows
/// may push a million times what comes of it, and that much of rounding is left.
constexpr double kRounding = 1e-12, kRoundingOfForces = 1e-15;
/// Of a row's own S_ii: a smaller pivot is rounding. Rows that are the same have e left, 1e-6 of it or more.
constexpr double kLeastPivot = 1e-14;
/// Rows enter once each, and few return: 20 times that never happened in 1e5 random problems.
constexpr int kRoundsPerRow = 20;
/// H is 1e-3 from its symmetric part, so hardly a row crosses a bound by that, and seldom a second one after it.
constexpr int kCorrections = 4;

class ActiveSet {
 public:
  ActiveSet(const BoundedProblem& problem, BoundedAnswer& answer) noexcept
      : p_(problem), a_(answer), tolerance_(std::max(problem.enough, kTiny)) {
    for (int i = 0; i < p_.count; ++i) {
      for (int j = 0; j <= i; ++j) {
        S_[i][j] = S_[j][i] = 0.5 * (p_.H[i][j] + p_.H[j][i]);
        sum_ += S_[i][j];
      }
      sum_ += p_.q[i];
      root_[i] = std::sqrt(std::max(S_[i][i], kTiny));
      tolerance_ = std::max(tolerance_, kRounding * std::abs(p_.q[i]));
      switch (a_.bound[i]) {
        case Bound::kZero:
          a_.lambda[i] = 0;
          break;
        case Bound::kFree:
          free_[free_count_++] = i;
          break;
        case Bound::kMost:
          a_.lambda[i] = p_.most[i];
          ++at_most_count_;
          break;
      }
    }
  }

  [[nodiscard]] int free_count() const noexcept { return free_count_; }
  [[nodiscard]] bool is_finite() const noexcept { return std::isfinite(sum_); }

  /// Lets go of the row that is most wrong at its bound. False: none is.
  bool let_go() noexcept {
    std::array<int, kMaxRows> pushing;
    int pushing_count = 0;
    double pushed = 0;  // |S_ij| <= root_i root_j
    for (int j = 0; j < p_.count; ++j) {
      if (!(a_.lambda[j] > 0)) continue;
      pushing[pushing_count++] = j;
      pushed += root_[j] * a_.lambda[j];
    }
    int worst = -1;
    double worst_by = 0;
    for (int i = 0; i < p_.count; ++i) {
      if (a_.bound[i] == Bound::kFree || !(p_.most[i] > 0) || is_barred_[i]) continue;
      double w = p_.q[i];
      for (int k = 0; k < pushing_count; ++k) w -= S_[i][pushing[k]] * a_.lambda[pushing[k]];
      const double by = a_.bound[i] == Bound::kZero ? w : -w;
      if (!(by > tolerance_ + kRoundingOfForces * root_[i] * pushed)) continue;
      if (by > worst_by * root_[i]) worst = i, worst_by = by / root_[i];
    }
    if (worst < 0) return false;
    at_most_count_ -= a_.bound[worst] == Bound::kMost;
    a_.bound[worst] = Bound::kFree;
    free_[free_count_++] = worst;
    entered_ = worst;
    return true;
  }

  /// Moves the free rows to where they are right, and leaves those behind that meet a bound.
  void settle() noexcept {
    for (int round = 0; round <= p_.count && free_count_ > 0; ++round) {
      solve_free();
      double t = 1;
      int hit = -1;
      Bound at = Bound::kZero;
      for (int f = 0; f < free_count_; ++f) {
        const int i = free_[f];
        const double bound = z_[f] < 0 ? 0 : p_.most[i];
        if (z_[f] >= 0 && z_[f] <= bound) continue;
        const double way = z_[f] - a_.lambda[i];
        const double share = way != 0 ? std::clamp((bound - a_.lambda[i]) / way, 0.0, 1.0) : 0;
        if (hit < 0 || share < t) t = share, hit = f, at = z_[f] < 0 ? Bound::kZero : Bound::kMost;
      }
      for (int f = 0; f < free_count_; ++f) {
        double& lambda = a_.lambda[free_[f]];
        lambda = std::clamp(lambda + t * (z_[f] - lambda), 0.0, p_.most[free_[f]]);
      }
      if (t > 0) is_barred_.fill(false);
      if (hit < 0) return;
      // What leaves as it came, by rounding, would come again for ever.
      if (free_[hit] == entered_ && !(t > 0)) is_barred_[entered_] = true;
      leave(hit, at);
    }
  }

 private:
  static constexpr double kTiny = 1e-300;  // of a row without any compliance, which is an error of the caller

  void leave(int f, Bound at) noexcept {
    const int i = free_[f];
    a_.bound[i] = at;
    at_most_count_ += at == Bound::kMost;
    a_.lambda[i] = at == Bound::kZero ? 0 : p_.most[i];
    for (int k = f; k + 1 < free_count_; ++k) free_[k] = free_[k + 1];
    --free_count_;
    factored_ = std::min(factored_, f);
  }

  void solve_free() noexcept {
    for (int a = factored_; a < free_count_; ++a) {
      const PerRow& row = S_[free_[a]];
      for (int b = 0; b <= a; ++b) {
        double sum = row[free_[b]];
        for (int k = 0; k < b; ++k) sum -= L_[a][k] * L_[b][k];
        L_[a][b] = b < a ? sum * inverse_pivot_[b] : sum;
      }
      inverse_pivot_[a] = 1 / std::sqrt(std::max({L_[a][a], kLeastPivot * row[free_[a]], kTiny}));
    }
    factored_ = free_count_;
    for (int a = 0; a < free_count_; ++a) {
      double sum = p_.q[free_[a]];
      for (int j = 0; at_most_count_ > 0 && j < p_.count; ++j)
        if (a_.bound[j] == Bound::kMost) sum -= S_[free_[a]][j] * a_.lambda[j];
      for (int k = 0; k < a; ++k) sum -= L_[a][k] * z_[k];
      z_[a] = sum * inverse_pivot_[a];
    }
    for (int a = free_count_ - 1; a >= 0; --a) {
      double sum = z_[a];
      for (int k = a + 1; k < free_count_; ++k) sum -= L_[k][a] * z_[k];
      z_[a] = sum * inverse_pivot_[a];
    }
  }

  const BoundedProblem& p_;
  BoundedAnswer& a_;
  double tolerance_, sum_ = 0;
  PerPair S_, L_;
  PerRow root_, inverse_pivot_, z_;  // root: sqrt(S_ii)
  std::array<int, kMaxRows> free_;
  std::array<bool, kMaxRows> is_barred_{};
  int free_count_ = 0, at_most_count_ = 0, factored_ = 0, entered_ = -1;
};

/// x with M x = x's value before, Gaussian elimination with partial pivoting. False: M is singular or not finite.
bool solve_as_it_is(PerPair& M, PerRow& x, int n) noexcept {
  for (int c = 0; c < n; ++c) {
    int pivot = c;
    for (int r = c + 1; r < n; ++r)
      if (std::abs(M[r][c]) > std::abs(M[pivot][c])) pivot = r;
    if (!(std::abs(M[pivot][c]) > 0)) return false;
    if (pivot != c) std::swap(M[pivot], M[c]), std::swap(x[pivot], x[c]);
    for (int r = c + 1; r < n; ++r) {
      const double share = M[r][c] / M[c][c];
      if (share == 0) continue;
      for (int k = c + 1; k < n; ++k) M[r][k] -= share * M[c][k];
      x[r] -= share * x[c];
    }
  }
  for (int r = n - 1; r >= 0; --r) {
    for (int k = r + 1; k < n; ++k) x[r] -= M[r][k] * x[k];
    x[r] /= M[r][r];
    if (!std::isfinite(x[r])) return false;
  }
  return true;
}

bool is_symmetric(const BoundedProblem& p) noexcept {
  for (int i = 0; i < p.count; ++i)
    for (int j = 0; j < i; ++j)
      if (p.H[i][j] != p.H[j][i]) return false;
  return true;
}

}  // namespace

SolveFigures solve_bounded(const BoundedProblem& problem, BoundedAnswer& answer) noexcept {
  SolveFigures figures;
  const int n = problem.count;
  for (int i = 0; i < n; ++i) {
    if (!(problem.most[i] > 0)) answer.bound[i] = Bound::kZero;
    // Also what is not a number.
    if (!(answer.lambda[i] >= 0 && answer.lambda[i] <= problem.most[i])) answer.lambda[i] = 0;
  }
  ActiveSet set(problem, answer);
  if (set.free_count() > 0) set.settle();
  for (; figures.iterations < kRoundsPerRow * (n + 1); ++figures.iterations) {
    if (!set.let_go()) {
      figures.is_solved = set.is_finite();
      break;
    }
    set.settle();
  }
  if (!is_symmetric(problem)) figures.is_as_it_is = solve_free_as_it_is(problem, answer);
  return figures;
}

bool solve_free_as_it_is(const BoundedProblem& p, BoundedAnswer& answer) noexcept {
  BoundedAnswer trial = answer;
  PerPair M;
  PerRow x;
  std::array<int, kMaxRows> free;
  for (int attempt = 0; attempt < kCorrections; ++attempt) {
    int n = 0;
    for (int i = 0; i < p.count; ++i)
      if (trial.bound[i] == Bound::kFree) free[n++] = i;
    for (int a = 0; a < n; ++a) {
      x[a] = p.q[free[a]];
      for (int j = 0; j < p.count; ++j)
        if (trial.bound[j] == Bound::kMost) x[a] -= p.H[free[a]][j] * trial.lambda[j];
      for (int b = 0; b < n; ++b) M[a][b] = p.H[free[a]][free[b]];
    }
    if (!solve_as_it_is(M, x, n)) return false;
    bool is_within = true;
    for (int a = 0; a < n; ++a) {
      const int i = free[a];
      if (x[a] < 0) trial.bound[i] = Bound::kZero, is_within = false;
      if (x[a] > p.most[i]) trial.bound[i] = Bound::kMost, is_within = false;
      trial.lambda[i] = std::clamp(x[a], 0.0, p.most[i]);
    }
    if (!is_within) continue;
    answer = trial;
    return true;
  }
  return false;
}

double violation(const BoundedProblem& p, const BoundedAnswer& answer) noexcept {
  double worst = 0;
  for (int i = 0; i < p.count; ++i) {
    double w = -p.q[i];
    for (int j = 0; j < p.count; ++j) w += p.H[i][j] * answer.lambda[j];
    const double lambda = answer.lambda[i];
    worst = std::max({worst, -lambda * p.H[i][i], (lambda - p.most[i]) * p.H[i][i]});
    if (!(p.most[i] > 0)) continue;
    worst = std::max(worst, lambda <= 0 ? -w : lambda >= p.most[i] ? w : std::abs(w));
  }
  return worst;
}

}  // namespace farfeel::constraint
