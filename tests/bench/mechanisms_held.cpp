// Mechanisms of a rigid tool: each axis is asked for 2 N or 20 mNm by the handle. A free one follows; a held one stays,
// but for what rows yield by themselves. Rotations are told as the way of a point 10 mm from the axis.
#include <cmath>
#include <numbers>

#include "tests/bench/mechanisms_cases.h"

namespace farfeel::bench {
namespace {

using constraint::Row;
using spatial::Pose;
using spatial::Vector6;
using test_support::RowLoop;
using test_support::Scene;

constexpr double kTick_s = 1e-3, kArm_m = 0.01, kHalfWidth_m = 0.004, kPitch_m = 1.5e-3;
/// Behind the coupling and the pad 3 mm are 2 N; behind k_r 4 mrad are 20 mNm.
constexpr double kAskedWay_m = 3e-3, kAskedTurn_rad = 4e-3;
constexpr int kSettled = 2000;  // ticks
constexpr std::array kAxes{"rx", "ry", "rz", "tx", "ty", "tz"};

void key_in_slot(const Pose& X_WQ, double too_thick_m, std::vector<Row>& rows) {
  for (const double along : {-1.0, 1.0})
    for (const double high : {-1.0, 1.0})
      for (const double side : {-1.0, 1.0})
        rows.push_back(test_support::point_on_plane(X_WQ, {along * kArm_m, side * kHalfWidth_m, high * 0.003},
                                                    {0, -side, 0}, -kHalfWidth_m + 0.5 * too_thick_m));
}

void bore_at(const Pose& X_WQ, double high_m, std::vector<Row>& rows) {
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5;
    rows.push_back(
        test_support::pin_in_bore(X_WQ, {0, 0, high_m}, kHalfWidth_m, {std::cos(angle), std::sin(angle), 0}));
  }
}

void cylinder_in_bore(const Pose& X_WQ, std::vector<Row>& rows) {
  for (const double high_m : {-kArm_m, kArm_m}) bore_at(X_WQ, high_m, rows);
}

void hinge(const Pose& X_WQ, std::vector<Row>& rows) {
  cylinder_in_bore(X_WQ, rows);
  for (const double side : {-1.0, 1.0})
    rows.push_back(test_support::point_on_plane(X_WQ, {0, 0, -side * kArm_m}, {0, 0, side}, -kArm_m));
}

/// What a nut has gone along its bolt, turning about it: the tool's z axis.
double turned_rad(const Pose& X) {
  const glm::dvec3 x = spatial::rotate(X, {1, 0, 0});
  return std::atan2(x.y, x.x);
}

/// Four places of a thread's two flanks, and one ring. A flank rises by the pitch in a turn: its normal n is z leaned
/// against the turning, and the nut's place there moves by u, up z + tilt and along the turning R theta.
void thread(const Pose& X_WQ, std::vector<Row>& rows) {
  bore_at(X_WQ, 0, rows);
  const double rise = std::atan(kPitch_m / (2 * std::numbers::pi * kHalfWidth_m));
  const glm::dvec3 axis = spatial::rotate(X_WQ, {0, 0, 1});
  for (int i = 0; i < 4; ++i) {
    const double angle = 0.5 * std::numbers::pi * i;
    const glm::dvec3 r = kHalfWidth_m * glm::dvec3(std::cos(angle), std::sin(angle), 0);
    const glm::dvec3 along{-std::sin(angle), std::cos(angle), 0};
    const double up_m = X_WQ.p.z - glm::dot(axis, r);
    const double along_m = kHalfWidth_m * turned_rad(X_WQ) + glm::dot(X_WQ.p, along);
    for (const double side : {-1.0, 1.0}) {
      Row row;
      row.damping_Ns_per_m = kMechanismStuff.damping_Ns_per_m;
      row.nhat_ST_W = side * (std::cos(rise) * glm::dvec3(0, 0, 1) - std::sin(rise) * along);
      row.p_ToC_W = r;
      row.depth_m = -side * (std::cos(rise) * up_m - std::sin(rise) * along_m);
      const glm::dvec3 by_turn =
          -std::cos(rise) * glm::cross(axis, r) - std::sin(rise) * glm::dvec3(0, 0, kHalfWidth_m);
      row.gradient << -side * spatial::to_eigen(by_turn), -spatial::to_eigen(row.nhat_ST_W);
      rows.push_back(row);
    }
  }
}

RowLoop loop_with(double dt_s = kTick_s) {
  return {{}, kMechanismGains, constraint::one_pad(kMechanismGains.stiffness_N_per_m), dt_s, {}};
}

/// The proxy's way, rotations at an arm.
Vector6 way_m(const Pose& X_WP, double arm_m = kArm_m) {
  Vector6 way;
  way << arm_m * spatial::to_eigen(spatial::vector_from_rotation(X_WP.R)), spatial::to_eigen(X_WP.p);
  return way;
}

/// Asks each axis of a mechanism without play. is_free: of the six.
void ask_axes(const std::string& name, const Scene& rows_of, const std::array<bool, 6>& is_free,
              std::vector<MechanismRow>& out) {
  const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
    rows_of(X_WQ, rows);
    test_support::name_in_order(rows);
  };
  for (int axis = 0; axis < 6; ++axis) {
    RowLoop loop = loop_with();
    Vector6 ask = Vector6::Zero();
    ask[axis] = axis < 3 ? kAskedTurn_rad : kAskedWay_m;
    for (int i = 0; i < kSettled; ++i) {
      const double share = std::min(1.0, i / 500.0);
      loop.tick(spatial::integrate({}, spatial::twist_from(share * ask), 1), scene);
    }
    Vector6 way = way_m(loop.touching().X_WP);
    if (is_free[axis]) way[axis] -= axis < 3 ? kArm_m * kAskedTurn_rad : kAskedWay_m;
    out.push_back({name + ", " + kAxes[axis] + (is_free[axis] ? " free" : " held"), way.cwiseAbs().maxCoeff(),
                   held_limit_m(loop), "m", loop.step_us()});
  }
}

void add_thread(std::vector<MechanismRow>& out) {
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    thread(X_WQ, rows);
    test_support::name_in_order(rows);
  };
  const auto off_helix = [](const Pose& X_WP) {
    Vector6 way = way_m(X_WP, kHalfWidth_m);  // where the flanks are
    way[2] = 0;
    way[5] -= kPitch_m / (2 * std::numbers::pi) * turned_rad(X_WP);
    return way.cwiseAbs().maxCoeff();
  };
  for (int axis = 0; axis < 7; ++axis) {
    RowLoop loop = loop_with();
    for (int i = 0; i < kSettled; ++i) {
      const double share = std::min(1.0, i / 1000.0);
      Vector6 ask = Vector6::Zero();
      if (axis < 6) ask[axis] = share * (axis < 3 ? kAskedTurn_rad : kAskedWay_m);
      // The seventh: half a radian along the helix, which nothing holds.
      if (axis == 6) ask[2] = 0.5 * share, ask[5] = 0.5 * share * kPitch_m / (2 * std::numbers::pi);
      loop.tick(spatial::integrate({}, spatial::twist_from(ask), 1), scene);
    }
    double error = off_helix(loop.touching().X_WP);
    if (axis == 6) error = std::max(error, kArm_m * std::abs(turned_rad(loop.touching().X_WP) - 0.5));
    out.push_back(
        {axis == 6 ? "nut on a thread, turned along it" : std::string("nut on a thread, stays on it, ") + kAxes[axis],
         error, held_limit_m(loop), "m", loop.step_us()});
  }
}

/// A box on its four corners, pressed and turned: it lies until the torque is N a.
void add_tipping(std::vector<MechanismRow>& out) {
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        rows.push_back(test_support::point_on_plane(X_WQ, {x * kArm_m, y * kArm_m, 0}, {0, 0, 1}, 0));
    test_support::name_in_order(rows);
  };
  RowLoop loop = loop_with();
  double lain_m = 0, limit_m = 0, share = 0;
  for (int i = 0; i < 20'000 && share == 0; ++i) {
    const double turn_rad = 2e-3 * std::max(0.0, i * kTick_s - 0.5);
    loop.tick({spatial::rotation_from_vector({0, turn_rad, 0}), {0, 0, -kAskedWay_m * std::min(1.0, i / 500.0)}},
              scene);
    if (i < 600) continue;
    const auto& forces = loop.touching().memory.forces;
    const double tips_Nm = loop.on_hand().force_N.z * kArm_m, torque_Nm = std::abs(loop.on_hand().torque_Nm.y);
    if (torque_Nm < 0.98 * tips_Nm) {
      lain_m = std::max(lain_m, kArm_m * glm::length(spatial::vector_from_rotation(loop.touching().X_WP.R)));
      limit_m = held_limit_m(loop);
    }
    if ((forces[0].normal_N <= 0 && forces[1].normal_N <= 0) || (forces[2].normal_N <= 0 && forces[3].normal_N <= 0))
      share = torque_Nm / tips_Nm;
  }
  out.push_back({"box on four corners, lies below N a", lain_m, limit_m, "m", loop.step_us()});
  out.push_back({"box on four corners, tips at N a", std::abs(share - 1), 0.01, "1", loop.step_us()});
}

/// What the tool did not make by moving is recess from birth: a slot that has no room for its key is calm.
void add_no_room(std::vector<MechanismRow>& out) {
  constexpr double kTooThick_m = 0.2e-3;
  for (const bool is_recess : {true, false}) {
    RowLoop loop = loop_with();
    const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      key_in_slot(X_WQ, kTooThick_m, rows);
      for (Row& row : rows)
        if (is_recess) row.recess_m = 0.5 * kTooThick_m;
      test_support::name_in_order(rows);
    };
    double steps_N = 0;
    glm::dvec3 last_N{0};
    for (int i = 0; i < kSettled; ++i) {
      loop.tick({}, scene);
      steps_N = std::max(steps_N, glm::length(loop.on_hand().force_N - last_N));
      last_N = loop.on_hand().force_N;
    }
    if (is_recess) out.push_back({"slot 0.2 mm too narrow: step of force", steps_N, 1e-3, "N", loop.step_us()});
    out.push_back({is_recess ? "slot 0.2 mm too narrow: squeeze" : "the same without recess: squeeze",
                   loop.normal_sum_N(), 1e-3, "N", loop.step_us(), is_recess});
  }
}

}  // namespace

double held_limit_m(const RowLoop& loop) {
  return loop.law().row_compliance_m_per_N * loop.normal_sum_N() + 1e-6;
}

void add_held_axes(std::vector<MechanismRow>& out) {
  const auto slot = [](const Pose& X_WQ, std::vector<Row>& rows) { key_in_slot(X_WQ, 0, rows); };
  ask_axes("key in a slot", slot, {false, true, false, true, false, true}, out);
  ask_axes("hinge", hinge, {false, false, true, false, false, false}, out);
  ask_axes("cylinder in a bore", cylinder_in_bore, {false, false, true, false, false, true}, out);
  add_thread(out);
  add_tipping(out);
  add_no_room(out);
}

}  // namespace farfeel::bench
