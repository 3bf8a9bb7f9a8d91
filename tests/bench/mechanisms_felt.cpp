// How stiff walls feel, in sum: the material is one pad, however many rows report it. And that the proxy stays where a
// surface is: on a new one, in a groove, on round edges.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "haptic_core/constraint/recess.h"
#include "tests/bench/mechanisms_cases.h"

namespace farfeel::bench {
namespace {

using constraint::Row;
using spatial::Pose;
using test_support::RowLoop;
using test_support::Scene;

constexpr double kPressed_m = 3e-3;  // 2 N
constexpr double kSeries_N_per_m = 1 / (1 / kMechanismGains.stiffness_N_per_m + 1 / kMechanismStuff.stiffness_N_per_m);
constexpr double kShareLost = 0.02;  // a felt share of 0.98

RowLoop loop_with(double dt_s, const Pose& X_WT = {}, const Pose& X_TG = {}) {
  return {{}, kMechanismGains, constraint::one_pad(kMechanismGains.stiffness_N_per_m), dt_s, X_WT, X_TG};
}

Pose at(const glm::dvec3& p) {
  return {{1, 0, 0, 0}, p};
}

glm::dvec3 tilted(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {std::sin(angle), 0, std::cos(angle)};
}

Scene planes(const std::vector<glm::dvec3>& normals) {
  return [normals](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const glm::dvec3& nhat : normals) rows.push_back(test_support::point_on_plane(X_WQ, {}, nhat, 0));
    test_support::name_in_order(rows);
  };
}

void press(RowLoop& loop, const Scene& scene) {
  for (double t = 0; t < 0.8; t += loop.dt_s()) loop.tick(at({0, 0, -kPressed_m * std::min(1.0, t / 0.3)}), scene);
}

void add_walls(std::vector<MechanismRow>& out) {
  struct Case {
    std::string name;
    std::vector<glm::dvec3> normals;
    double limit;
  };
  const std::vector<Case> cases{{"one wall", {tilted(0)}, kShareLost},
                                {"two walls at 90 degrees", {tilted(45), tilted(-45)}, kShareLost},
                                {"two walls at 30 degrees", {tilted(15), tilted(-15)}, kShareLost},
                                {"eight duplicates", std::vector(8, tilted(0)), 0.01}};
  for (const double dt_s : {1e-3, 0.2e-3})
    for (const Case& c : cases) {
      RowLoop loop = loop_with(dt_s);
      press(loop, planes(c.normals));
      const double felt_N_per_m = loop.on_hand().force_N.z / kPressed_m;
      out.push_back({c.name + (dt_s < 1e-3 ? ", 5 kHz: felt" : ": felt"), std::abs(felt_N_per_m / kSeries_N_per_m - 1),
                     c.limit, "1", loop.step_us()});
    }
}

void add_levers(std::vector<MechanismRow>& out) {
  for (const double lever_m : {0.01, 0.03}) {
    RowLoop loop = loop_with(1e-3, {}, at({0, 0, 0.05}));
    const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      rows.push_back(test_support::point_on_plane(X_WQ, {lever_m, 0, 0}, {0, 0, 1}, 0));
    };
    constexpr double kWay_m = 0.2e-3;  // so that the lever hardly turns
    for (int i = 0; i < 3000; ++i) loop.tick(at({0, 0, 0.05 - kWay_m * std::min(1.0, i / 500.0)}), scene);
    const double series_N_per_m =
        1 / (1 / kSeries_N_per_m + lever_m * lever_m / kMechanismGains.rotational_stiffness_Nm_per_rad);
    out.push_back({lever_m < 0.02 ? "contact at a lever of 10 mm: felt" : "contact at a lever of 30 mm: felt",
                   std::abs(loop.on_hand().force_N.z / kWay_m / series_N_per_m - 1), kShareLost, "1", loop.step_us()});
  }
}

void add_blinking(std::vector<MechanismRow>& out) {
  for (const double dt_s : {1e-3, 0.2e-3})
    for (const bool is_aside : {false, true}) {
      std::mt19937 random(2);
      std::array<bool, 8> is_there{};
      const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
        rows.push_back(test_support::point_on_plane(X_WQ, {}, tilted(0), 0));
        for (std::size_t i = is_aside ? 7 : 1; i < is_there.size(); ++i)
          if (is_there[i]) rows.push_back(test_support::point_on_plane(X_WQ, {}, tilted(is_aside ? 20 : 0), 0));
        test_support::name_in_order(rows);
      };
      RowLoop loop = loop_with(dt_s);
      double sum_N = 0, squares_N2 = 0;
      int counted = 0;
      for (int i = 0; i < 3 / dt_s; ++i) {
        if (i % 5 == 0)
          for (bool& there : is_there) there = random() & 1;
        loop.tick(at({0, 0, -kPressed_m * std::min(1.0, i * dt_s / 0.3)}), scene);
        if (i * dt_s < 2) continue;
        const double force_N = glm::length(loop.on_hand().force_N);
        sum_N += force_N, squares_N2 += force_N * force_N, ++counted;
      }
      const double mean_N = sum_N / counted;
      const double ripple = std::sqrt(std::max(0.0, squares_N2 / counted - mean_N * mean_N)) / mean_N;
      out.push_back({std::string(is_aside ? "a row 20 degrees aside blinks" : "seven duplicates of eight blink") +
                         (dt_s < 1e-3 ? ", 5 kHz: ripple" : ": ripple"),
                     ripple, 1e-3, "1", loop.step_us()});
    }
}

/// A ball in a groove of 90 degrees: held across it, free along it and to turn.
void add_groove(std::vector<MechanismRow>& out) {
  constexpr double kRadius_m = 5e-3, kAlong_m = 5e-3, kTurn_rad = 0.1;
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const double side : {45.0, -45.0}) {
      const glm::dvec3 nhat = tilted(side);
      // The ball's place that is nearest, wherever it has turned to.
      rows.push_back(test_support::point_on_plane(X_WQ, spatial::rotate_back(X_WQ, -kRadius_m * nhat), nhat, 0));
    }
    test_support::name_in_order(rows);
  };
  const double high_m = kRadius_m * std::numbers::sqrt2;
  RowLoop loop = loop_with(1e-3, at({0, 0, high_m}));
  for (int i = 0; i < 3000; ++i) {
    const double share = std::clamp(i / 1000.0 - 0.5, 0.0, 1.0);
    loop.tick({spatial::rotation_from_vector({0, share * kTurn_rad, 0}),
               {share * 1e-3, share * kAlong_m, high_m - kPressed_m * std::min(1.0, i / 500.0)}},
              scene);
  }
  const Pose& X_WP = loop.touching().X_WP;
  const double turned_rad = spatial::vector_from_rotation(X_WP.R).y;
  out.push_back({"ball in a groove: held across it", std::max(std::abs(X_WP.p.x), std::abs(X_WP.p.z - high_m)),
                 held_limit_m(loop), "m", loop.step_us()});
  out.push_back({"ball in a groove: free along it, and to turn",
                 std::max(std::abs(X_WP.p.y - kAlong_m), kRadius_m * std::abs(turned_rad - kTurn_rad)), 1e-6, "m",
                 loop.step_us()});
  out.push_back({"ball in a groove: felt", std::abs(loop.on_hand().force_N.z / kPressed_m / kSeries_N_per_m - 1),
                 kShareLost, "1", loop.step_us()});
}

/// The surface is 1.5 mm higher from one tick to the next.
void add_new_surface(std::vector<MechanismRow>& out) {
  constexpr double kRise_m = 1.5e-3, kMade_m = 5e-6;
  RowLoop loop = loop_with(1e-3);
  double surface_m = 0, recess_m = 0;
  const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, surface_m));
    rows.back().recess_m = recess_m;
  };
  press(loop, scene);
  const double before_N = loop.on_hand().force_N.z;
  surface_m = kRise_m;
  std::vector<Row> now;
  scene(loop.touching().X_WP, now);
  recess_m = constraint::unmade_depth_m(now[0], loop.touching().X_WP, loop.touching().X_WP, kMade_m);
  loop.tick(at({0, 0, -kPressed_m}), scene);
  out.push_back({"surface up by 1.5 mm: step of force", std::abs(loop.on_hand().force_N.z - before_N), 1e-3, "N",
                 loop.step_us()});
  out.push_back({"surface up by 1.5 mm: proxy off it", std::abs(loop.touching().X_WP.p.z - surface_m), 1e-6, "m",
                 loop.step_us()});
}

/// A bar along y, 10 mm wide and 8 mm high below z = 0, with rounded edges: what is outside is above 0.
double outside_m(const glm::dvec3& p, double radius_m, glm::dvec3& outward) {
  const double x = std::abs(p.x) - 5e-3 + radius_m, z = std::abs(p.z + 4e-3) - 4e-3 + radius_m;
  glm::dvec3 nhat = x > z ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
  double outside = std::max(x, z) - radius_m;
  if (x > 0 && z > 0) nhat = glm::normalize(glm::dvec3(x, 0, z)), outside = std::hypot(x, z) - radius_m;
  outward = {p.x < 0 ? -nhat.x : nhat.x, 0, p.z < -4e-3 ? -nhat.z : nhat.z};
  return outside;
}

}  // namespace

void add_felt_pads(std::vector<MechanismRow>& out) {
  add_walls(out);
  add_levers(out);
  add_blinking(out);
  add_groove(out);
  add_new_surface(out);
}

void add_round_edges(std::vector<MechanismRow>& out) {
  constexpr double kPress_N = 3, kOver_m = 12e-3, kSettle_s = 0.5;
  for (const double radius_m : {0.1e-3, 0.5e-3, 2e-3}) {
    MechanismRow inside{
        "edge of " + std::to_string(radius_m * 1e3).substr(0, 3) + " mm: inside beyond e lambda", 0, 1e-6, "m", {}};
    MechanismRow hangs{
        "edge of " + std::to_string(radius_m * 1e3).substr(0, 3) + " mm: in the air while pushing", 0, 0.1e-3, "m", {}};
    for (const double dt_s : {1e-3, 0.2e-3})
      for (const double speed_m_s : {0.02, 0.1}) {
        RowLoop loop = loop_with(dt_s, at({0, 0, 1e-3}));
        const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
          glm::dvec3 nhat;
          const double outside = outside_m(X_WQ.p, radius_m, nhat);
          rows.push_back(test_support::point_on_plane(X_WQ, {}, nhat, glm::dot(nhat, X_WQ.p) - outside));
        };
        for (double t = 0; t < kSettle_s + kOver_m / speed_m_s + 0.3; t += dt_s) {
          const double along_m = std::clamp((t - kSettle_s) * speed_m_s, 0.0, kOver_m);
          loop.tick(at({along_m, 0, 1e-3 - (1e-3 + kPress_N / kSeries_N_per_m) * std::min(1.0, t / 0.3)}), scene);
          glm::dvec3 nhat;
          const double outside = outside_m(loop.touching().X_WP.p, radius_m, nhat);
          const double normal_N = loop.normal_sum_N();
          inside.error = std::max(inside.error, -outside - loop.law().row_compliance_m_per_N * normal_N);
          if (normal_N > 0.05) hangs.error = std::max(hangs.error, outside);
        }
        inside.solve_us.insert(inside.solve_us.end(), loop.step_us().begin(), loop.step_us().end());
      }
    hangs.solve_us = inside.solve_us;
    out.push_back(inside);
    out.push_back(hangs);
  }
}

}  // namespace farfeel::bench
