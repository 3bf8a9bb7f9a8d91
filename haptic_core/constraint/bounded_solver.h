// Forces of rows that only push, and push no more than they may:
//   w = H l - q,   0 <= l <= most,   l_i = 0 => w_i >= 0,   l_i = most_i => w_i <= 0,   else w_i = 0.
// For a symmetric positive definite H that is min l.H l / 2 - q.l in a box, and has one answer.
//
// A dual active set: C. Lawson and R. Hanson, Solving Least Squares Problems, 1974, ch. 23, with upper bounds after
// P. Stark and R. Parker, Computational Statistics 10, 1995. One row at a time is let go of its bound, and each step
// ends at the first bound that it meets.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/constraint/row.h"

namespace farfeel::constraint {

/// Lengths and forces of all rows; only the first `count` are read.
using PerRow = std::array<double, kMaxRows>;
using PerPair = std::array<PerRow, kMaxRows>;  ///< [i][j]: of row i, by row j

struct BoundedProblem {
  int count = 0;  ///< 0 to kMaxRows
  PerPair H;      ///< need not be symmetric; its symmetric part is positive definite
  PerRow q;
  PerRow most;        ///< >= 0
  double enough = 0;  ///< >= 0: a row at its bound that is wrong by no more stays there [unit of q]
};

enum class Bound : std::uint8_t { kZero, kFree, kMost };

/// In: where to start, each lambda within its bounds; what is default starts cold. Out: the answer.
struct BoundedAnswer {
  PerRow lambda{};
  std::array<Bound, kMaxRows> bound{};
};

struct SolveFigures {
  int iterations = 0;      ///< rows let go of a bound
  bool is_solved = false;  ///< false: stopped at the most iterations; the answer is within its bounds all the same
  /// The final active block holds with H as it is. False: the answer is that of H's symmetric part.
  bool is_as_it_is = true;
};

/// The active set is found with H's symmetric part. Then the rows that are on no bound are solved once more, by LU,
/// with H as it is: the coupling's tangent and the gyroscopic torque make 1e-3 of it unsymmetric, which would be 1e-3
/// of the force. Bounds are checked after that. Bounded time, no allocation; realtime-safe. Not finite input gives an
/// answer that is not solved.
SolveFigures solve_bounded(const BoundedProblem&, BoundedAnswer&) noexcept;

/// Only the second half: solves the rows that are on no bound with H as it is, from an answer whose active set is
/// known. One that crosses a bound is put there, and the others are solved again. False, and the answer as it was: H is
/// singular there, or bounds go on being crossed. Realtime-safe.
bool solve_free_as_it_is(const BoundedProblem&, BoundedAnswer&) noexcept;

/// How far an answer is from its conditions [unit of q], H as it is: for tests.
[[nodiscard]] double violation(const BoundedProblem&, const BoundedAnswer&) noexcept;

}  // namespace farfeel::constraint
