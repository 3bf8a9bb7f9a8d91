#include "haptic_core/constraint/proxy_shift.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptic_core/constraint/mobility.h"

namespace farfeel::constraint {
namespace {

using Eigen::Vector3d;
using spatial::Vector6;

/// What the proxy may move sideways in a tick beyond the tool's way. It has to follow forces that turn: a hand turns 3
/// N across a pad of 1 N/mm in 60 ms at 50 um a tick. Edges of 0.1 mm are then left by at most 67 um (3 N, 1 kHz).
constexpr double kSideways_m = 50e-6;
/// Of a matrix's own diagonal: what makes rows that are the same solvable. 3 mm of push are then off by 3 nm.
constexpr double kShared = 1e-6;
/// The proxy may go so many times as far as the deepest row was deep where it was looked up, and what it may move
/// sideways beyond: walls at 14 degrees that are told anew ask for as much. Walls that oppose each other a little
/// aslant and leave no room ask for far more, and would squirt the proxy out. They get a push with so much shared that
/// it is five times the depth at most, and the proxy goes no farther sideways than the tool: else it would wander
/// between them, as each look finds other slopes there. A floor between them is left deep by 2 % of its push.
constexpr double kMostLever = 8, kNoRoom = 0.02;
/// A push is not bounded: walls that leave no room ask for their overlap over kShared, and what is left of that counts.
constexpr double kNoBound_m = 1e9;

/// A push that slopes ask for may be so much longer than along the bare directions; else slopes are too steep for it.
constexpr double kMostLonger = 2;

using Directions = std::array<Vector3d, kMaxRows>;

/// sum along_j m_j, m >= 0, that takes the depths off rows, where along_i.along_j is what a push along j takes off i.
Vector3d push_sharing(const PerRow& depth_m, int n, const Directions& along, double shared, BoundedProblem& problem,
                      BoundedAnswer& m) noexcept {
  problem.count = n;
  problem.enough = 0.5 * kOnSurface_m;
  for (int i = 0; i < n; ++i) {
    problem.q[i] = depth_m[i];
    problem.most[i] = kNoBound_m;
    for (int j = 0; j < n; ++j) problem.H[i][j] = along[i].dot(along[j]) * (i == j ? 1 + shared : 1);
  }
  (void)solve_bounded(problem, m);
  Vector3d shift = Vector3d::Zero();
  for (int i = 0; i < n; ++i) shift += m.lambda[i] * along[i];
  return shift;
}

/// How far the proxy may go in a tick, pushed from where it has come.
struct Room {
  Vector3d come_W;  ///< from where it was at the tick's begin
  double most_m;
  [[nodiscard]] bool has(const Vector3d& shift_W) const noexcept { return (come_W + shift_W).norm() <= most_m; }
};

/// The same, sharing no more than there is room for. has_room: whether there is any.
Vector3d push(const PerRow& depth_m, int n, const Directions& along, const Room& room, BoundedProblem& problem,
              BoundedAnswer& m, bool& has_room) noexcept {
  const Vector3d shift = push_sharing(depth_m, n, along, kShared, problem, m);
  has_room = room.has(shift);
  if (has_room) return shift;
  m = {};
  return push_sharing(depth_m, n, along, kNoRoom, problem, m);
}

/// The same along the pad's directions, with slopes: a push along n_j takes out_i.n_j off row i. On two walls that are
/// ridged aslant, each would else be lifted by the other's push times its slope, 0.1 of 2 mm.
Vector3d push_along_pad(const PerRow& depth_m, int n, const Directions& nhat, const Directions& out, const Room& room,
                        bool& has_room) noexcept {
  BoundedProblem problem;
  BoundedAnswer m;
  const Vector3d level = push_sharing(depth_m, n, nhat, kShared, problem, m);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) problem.H[i][j] = out[i].dot(nhat[j]) * (i == j ? 1 + kShared : 1);
  Vector3d shift = level;
  if (BoundedAnswer sloped = m; solve_free_as_it_is(problem, sloped)) {
    Vector3d along_slopes = Vector3d::Zero();
    for (int i = 0; i < n; ++i) along_slopes += sloped.lambda[i] * nhat[i];
    if (along_slopes.norm() <= kMostLonger * level.norm()) shift = along_slopes;
  }
  has_room = room.has(shift);
  if (has_room) return shift;
  m = {};
  return push_sharing(depth_m, n, nhat, kNoRoom, problem, m);
}

}  // namespace

ProxyPose pushed_out(std::span<const Row> all, const ContactForces& forces, const ProxyStep& step) noexcept {
  const std::span<const Row> rows = all.first(std::min<std::size_t>(all.size(), kMaxRows));
  const int n = static_cast<int>(rows.size());
  Directions nhat, out;  // out: -d depth / d translation
  PerRow at_X, depth_m;
  double deepest_at_Q_m = 0;
  const Vector6 way = way_between(step.X_WQ, step.X_WT);
  for (int i = 0; i < n; ++i) {
    nhat[i] = spatial::to_eigen(rows[i].nhat_ST_W);
    out[i] = -rows[i].gradient.tail<3>();
    at_X[i] = rows[i].depth_m + rows[i].gradient.dot(way);
    deepest_at_Q_m = std::max(deepest_at_Q_m, rows[i].depth_m);
  }
  const auto deepest_at = [&](const Vector3d& shift) {
    double deepest = 0;
    for (int i = 0; i < n; ++i) {
      depth_m[i] = at_X[i] - out[i].dot(shift);
      deepest = std::max(deepest, depth_m[i]);
    }
    return deepest;
  };

  Vector3d shift = spatial::to_eigen(forces.friction_shift_W);
  if (deepest_at(shift) > kOnSurface_m) {
    const double free_m = step.way_m + kSideways_m;
    const Vector3d come = spatial::to_eigen(step.X_WT.p - step.p_WP_before);
    Room room{come + shift, kMostLever * deepest_at_Q_m + free_m};
    bool has_room = true;
    const Vector3d pushed = push_along_pad(depth_m, n, nhat, out, room, has_room);
    shift += pushed;

    const double most_m = forces.is_any_saturated ? 0 : has_room ? free_m : step.way_m;
    const Vector3d moved = come + shift;
    const double length_m = pushed.norm();
    const Vector3d along = length_m > 0 ? Vector3d(pushed / length_m) : Vector3d(Vector3d::Zero());
    const Vector3d sideways = moved - along.dot(moved) * along;
    const double sideways_m = sideways.norm();
    if (sideways_m > most_m) shift -= (1 - most_m / sideways_m) * sideways;

    if (deepest_at(shift) > kOnSurface_m) {
      BoundedProblem problem;
      BoundedAnswer least;
      room.come_W = come + shift;
      const Vector3d left = push(depth_m, n, out, room, problem, least, has_room);
      shift += has_room ? left : std::min(1.0, step.way_m / left.norm()) * left;
    }
  }

  ProxyPose proxy{{step.X_WT.R, step.X_WT.p + spatial::to_glm(shift)}, 0};
  proxy.depth_m = deepest_at(shift);
  return proxy;
}

}  // namespace farfeel::constraint
