// Against the slow obvious way: every row at zero, free or at its most, 3^n cases, the one that holds.
#include "haptic_core/constraint/bounded_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#ifdef FARFEEL_TEST_BULLET
#include <BulletDynamics/MLCPSolvers/btDantzigLCP.h>
#endif

#include "haptic_core/spatial/spatial.h"

namespace farfeel::constraint {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::Vector6;

enum class Kind { kAny, kDuplicates, kNearDuplicates, kOpposed, kParallel, kTight, kZeroGaps };
constexpr std::array kKinds{Kind::kAny,      Kind::kDuplicates, Kind::kNearDuplicates, Kind::kOpposed,
                            Kind::kParallel, Kind::kTight,      Kind::kZeroGaps};

class BoundedSolverTest : public ::testing::Test {
 protected:
  double uniform() { return std::uniform_real_distribution<>(0, 1)(random_); }
  double normal() { return std::normal_distribution<>()(random_); }
  Vector3d normal3() { return {normal(), normal(), normal()}; }

  /// n rows on a free tool of 1 to 100 g behind a coupling of 2 kN/m at 1 kHz; e as a row's own compliance.
  BoundedProblem problem(int n, Kind kind, double e, double skew = 0) {
    constexpr double h = 1e-3;
    const double m = 0.001 * std::pow(100, uniform()), inertia = m * 1e-4 * (0.5 + uniform());
    Vector6 A;
    A << Vector3d::Constant(inertia + h * 0.003 + h * h * 6), Vector3d::Constant(m + h + h * h * 2000);
    std::vector<Vector6> g(n);
    for (int i = 0; i < n; ++i) {
      Vector3d nhat = normal3().normalized();
      if (kind == Kind::kParallel || kind == Kind::kZeroGaps) nhat = Vector3d::UnitZ();
      if (kind == Kind::kOpposed && i % 2 == 1) nhat = -g[i - 1].tail<3>();
      const Vector3d r = 0.03 * normal3();
      g[i] << r.cross(nhat), nhat;
      const bool is_copy = i > 0 && uniform() < 0.7;
      if (is_copy && (kind == Kind::kDuplicates || kind == Kind::kNearDuplicates)) {
        g[i] = g[static_cast<int>(uniform() * i)];
        if (kind == Kind::kNearDuplicates)
          for (double& a : g[i]) a += 1e-7 * normal();
      }
    }
    Vector6 V;
    V << 3 * normal3(), 0.3 * normal3();
    BoundedProblem p;
    p.count = n;
    for (int i = 0; i < n; ++i) {
      p.q[i] = 2e-4 * normal() + h * g[i].dot(V);
      if (kind == Kind::kZeroGaps && uniform() < 0.5) p.q[i] = uniform() < 0.6 ? 0 : h * g[i].dot(V);
      p.most[i] = kind != Kind::kTight ? 36 : uniform() < 0.1 ? 0 : 3 * uniform();
      for (int j = 0; j <= i; ++j)
        p.H[i][j] = p.H[j][i] = h * h * g[i].dot(A.cwiseInverse().cwiseProduct(g[j])) + (i == j ? e : 0);
    }
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) {
        const double off = skew * normal() * std::sqrt(p.H[i][i] * p.H[j][j]);
        p.H[i][j] += off, p.H[j][i] -= off;
      }
    return p;
  }

  std::mt19937_64 random_{7};
};

/// The answer that violates its conditions least, of all 3^n.
VectorXd enumerated(const BoundedProblem& p, double& violated) {
  const int n = p.count;
  int cases = 1;
  for (int i = 0; i < n; ++i) cases *= 3;
  VectorXd best = VectorXd::Zero(n);
  violated = 1e300;
  for (int c = 0; c < cases; ++c) {
    BoundedAnswer answer;
    std::vector<int> free;
    for (int i = 0, rest = c; i < n; ++i, rest /= 3) {
      if (rest % 3 == 2) answer.lambda[i] = p.most[i];
      if (rest % 3 == 1) free.push_back(i);
    }
    const int m = static_cast<int>(free.size());
    MatrixXd M(m, m);
    VectorXd b(m);
    for (int a = 0; a < m; ++a) {
      b[a] = p.q[free[a]];
      for (int j = 0; j < n; ++j) b[a] -= p.H[free[a]][j] * answer.lambda[j];
      for (int k = 0; k < m; ++k) M(a, k) = p.H[free[a]][free[k]];
    }
    if (m > 0) {
      const VectorXd x = M.partialPivLu().solve(b);
      for (int a = 0; a < m; ++a) answer.lambda[free[a]] = x[a];
    }
    const double by = violation(p, answer);
    if (by >= violated) continue;
    violated = by;
    for (int i = 0; i < n; ++i) best[i] = answer.lambda[i];
  }
  return best;
}

double greatest(const PerRow& values, int n) {
  double most = 0;
  for (int i = 0; i < n; ++i) most = std::max(most, std::abs(values[i]));
  return most;
}

TEST_F(BoundedSolverTest, IsWhatEnumerationFinds) {
  int tried = 0;
  for (int i = 0; i < 21'000; ++i) {
    const Kind kind = kKinds[i % kKinds.size()];
    const double e = std::pow(10, -9 + 5.7 * uniform());  // 1e-9 to 5e-4 m/N
    const BoundedProblem p = problem(1 + i / 7 % 5, kind, e);
    BoundedAnswer answer;
    ASSERT_TRUE(solve_bounded(p, answer).is_solved) << i;
    // In the units of q: 1e-10 of the greatest, far below the rounding of a depth in a scene of a metre.
    ASSERT_LE(violation(p, answer), 1e-10 * greatest(p.q, p.count)) << i;
    double violated = 0;
    const VectorXd expected = enumerated(p, violated);
    if (violated > 1e-10 * greatest(p.q, p.count)) continue;  // enumeration's own elimination is no better here
    ++tried;
    for (int k = 0; k < p.count; ++k)
      ASSERT_NEAR(answer.lambda[k], expected[k], 1e-9 + 1e-14 * greatest(p.q, p.count) / e) << i << ' ' << k;
  }
  EXPECT_GE(tried, 20'000);
}

TEST_F(BoundedSolverTest, WhereItStartsDoesNotCount) {
  for (int i = 0; i < 2000; ++i) {
    const BoundedProblem p = problem(1 + i % kMaxRows, kKinds[i % kKinds.size()], 3e-6);
    BoundedAnswer cold, warm;
    ASSERT_TRUE(solve_bounded(p, cold).is_solved);
    for (int k = 0; k < p.count; ++k) {
      warm.bound[k] = static_cast<Bound>(static_cast<int>(3 * uniform()));
      warm.lambda[k] = p.most[k] * uniform();
    }
    ASSERT_TRUE(solve_bounded(p, warm).is_solved);
    for (int k = 0; k < p.count; ++k) ASSERT_NEAR(warm.lambda[k], cold.lambda[k], 1e-7) << i << ' ' << k;
    BoundedAnswer again = cold;
    EXPECT_EQ(solve_bounded(p, again).iterations, 0);
  }
}

TEST_F(BoundedSolverTest, TheActiveBlockHoldsWithAMatrixThatIsNotSymmetric) {
  int as_they_are = 0;
  for (int i = 0; i < 5000; ++i) {
    const BoundedProblem p = problem(1 + i % 12, Kind::kAny, 1e-3, 1e-3);
    BoundedAnswer answer;
    const SolveFigures figures = solve_bounded(p, answer);
    ASSERT_TRUE(figures.is_solved);
    as_they_are += figures.is_as_it_is;
    for (int k = 0; k < p.count; ++k) {
      ASSERT_GE(answer.lambda[k], 0);
      ASSERT_LE(answer.lambda[k], p.most[k]);
      if (!figures.is_as_it_is || answer.bound[k] != Bound::kFree) continue;
      double w = -p.q[k];
      for (int j = 0; j < p.count; ++j) w += p.H[k][j] * answer.lambda[j];
      ASSERT_LE(std::abs(w), 1e-14 + 1e-12 * greatest(p.q, p.count));
    }
  }
  EXPECT_GE(as_they_are, 4990);
}

TEST_F(BoundedSolverTest, IsWhatBulletsDantzigFinds) {
#ifdef FARFEEL_TEST_BULLET
  int solved = 0;
  for (int i = 0; i < 5000; ++i) {
    const int n = 1 + i % 16;
    const BoundedProblem p = problem(n, kKinds[i % kKinds.size()], 3e-6);
    BoundedAnswer answer;
    ASSERT_TRUE(solve_bounded(p, answer).is_solved);
    const int stride = n;
    std::vector<btScalar> A(n * stride, 0), x(n, 0), b(n), w(n, 0), low(n, 0), high(n);
    for (int r = 0; r < n; ++r) {
      b[r] = p.q[r], high[r] = p.most[r];
      for (int c = 0; c < n; ++c) A[r * stride + c] = p.H[r][c];
    }
    btDantzigScratchMemory scratch;
    if (!btSolveDantzigLCP(n, A.data(), x.data(), b.data(), w.data(), 0, low.data(), high.data(), nullptr, scratch))
      continue;
    BoundedAnswer theirs;
    for (int k = 0; k < n; ++k) theirs.lambda[k] = x[k];
    bool is_right = violation(p, theirs) <= 1e-9 * greatest(p.q, n);  // it ends early, or in no number, on some
    for (const btScalar force : x) is_right = is_right && std::isfinite(force);
    if (!is_right) continue;
    ++solved;
    for (int k = 0; k < n; ++k) ASSERT_NEAR(answer.lambda[k], x[k], 1e-6) << i << ' ' << k;
  }
  RecordProperty("solved_by_bullet", solved);
  EXPECT_GE(solved, 4000);
#else
  GTEST_SKIP() << "Bullet in double precision (bullet-float64) was not found";
#endif
}

TEST_F(BoundedSolverTest, TellsWhatIsNoNumber) {
  BoundedProblem p = problem(4, Kind::kAny, 3e-6);
  BoundedAnswer answer;
  p.H[2][2] = std::nan("");
  EXPECT_FALSE(solve_bounded(p, answer).is_solved);
  p = problem(4, Kind::kAny, 3e-6);
  p.q[1] = std::nan("");
  answer = {};
  EXPECT_FALSE(solve_bounded(p, answer).is_solved);
  answer = {};
  p.count = 0;
  EXPECT_TRUE(solve_bounded(p, answer).is_solved);
}

}  // namespace
}  // namespace farfeel::constraint
