// Friction of one contact: the force in a ball that holds the contact, or drags against its slip.
//
// The contact's slip in a step is W f - b, W positive definite. Where some |f| <= R makes it zero, it sticks. Else f
// minimises f.W f / 2 - b.f on the ball, so that (W + mu I) f = b with mu > 0: slip = -mu f, straight against f. A
// force that is only cut to its length would pull a tool at an arm aside.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace farfeel::constraint {

template <int N>
using Block = Eigen::Matrix<double, N, N>;
template <int N>
using BlockVector = Eigen::Matrix<double, N, 1>;

/// f that drags with |f| = most against the slip W f - b. Precondition: W symmetric, positive definite, and
/// |W^-1 b| >= most >= 0. Newton on 1 / |f(mu)| - 1 / most, which is concave and grows: it comes from below and stays
/// there. Realtime-safe; cannot fail.
template <int N>
[[nodiscard]] BlockVector<N> dragging_force(const Block<N>& W, const BlockVector<N>& b, double most) noexcept {
  if (!(most > 0)) return BlockVector<N>::Zero();
  // Each step squares the error; from mu = 0 eight leave rounding for every W with eigenvalues within 1 : 1e4.
  constexpr int kSteps = 12;
  constexpr double kEnough = 1e-12;
  double mu = 0;
  BlockVector<N> f;
  for (int i = 0; i < kSteps; ++i) {
    const Block<N> inverse = Block<N>(W + mu * Block<N>::Identity()).inverse();
    f = inverse * b;
    const double length = f.norm();
    if (!(length > most * (1 + kEnough))) break;
    const double falls = f.dot(inverse * f) / (length * length);  // -d ln|f| / d mu
    mu += (length / most - 1) / falls;
  }
  return f * (most / f.norm());
}

}  // namespace farfeel::constraint
