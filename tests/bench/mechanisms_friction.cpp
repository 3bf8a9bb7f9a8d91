// Friction: where slopes let go, that what sticks stays for a minute, that a wedge holds; and what a step takes.
#include <cmath>
#include <numbers>
#include <random>

#include "tests/bench/mechanisms_cases.h"

namespace farfeel::bench {
namespace {

using constraint::Row;
using spatial::Pose;
using test_support::RowLoop;
using test_support::Scene;

constexpr double kTick_s = 1e-3, kFriction = 0.3;

RowLoop loop_with() {
  return {{}, kMechanismGains, constraint::one_pad(kMechanismGains.stiffness_N_per_m), kTick_s, {}};
}

Pose at(const glm::dvec3& p) {
  return {{1, 0, 0, 0}, p};
}

Scene planes(const std::vector<glm::dvec3>& normals) {
  return [normals](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const glm::dvec3& nhat : normals)
      rows.push_back(test_support::point_on_plane(X_WQ, {}, glm::normalize(nhat), 0, {.friction = kFriction}));
    test_support::name_in_order(rows);
  };
}

/// The slope at which a free tool begins to go 10 mm in two seconds, under 1 N.
void add_slopes(std::vector<MechanismRow>& out) {
  for (const int copies : {1, 8}) {
    double holds = 0.5, slides = 1.5;  // of atan mu
    std::vector<double> step_us;
    for (int halving = 0; halving < 14; ++halving) {
      const double share = 0.5 * (holds + slides), slope = share * std::atan(kFriction);
      RowLoop loop = loop_with();
      const Scene scene = planes(std::vector(copies, glm::dvec3(std::sin(slope), 0, std::cos(slope))));
      glm::dvec3 from{0};
      for (int i = 0; i < 3000; ++i) {
        loop.push({0, 0, -std::min(1.0, i / 1000.0)}, scene);
        if (i == 1000) from = loop.touching().X_WP.p;
      }
      (glm::length(loop.touching().X_WP.p - from) > 0.01 ? slides : holds) = share;
      step_us = loop.step_us();
    }
    out.push_back({copies > 1 ? "slope, eight duplicates: slides at atan mu" : "slope: slides at atan mu",
                   std::abs(holds - 1), 1e-3, "1", step_us});
  }
}

/// Held for a minute by a hand that trembles, at 0.8 of what friction holds. Means over two seconds are compared,
/// because what trembles is no drift. Walls first share the load between them for up to a minute, by 60 nm.
void add_drifts(std::vector<MechanismRow>& out) {
  struct Case {
    std::string name;
    std::vector<glm::dvec3> normals;
    glm::dvec3 load_N;
  };
  const double mu = 0.8 * kFriction;
  const std::vector<Case> cases{
      {"plane", {{0, 0, 1}}, {2 * mu, 0, -2}},
      {"eight duplicates", std::vector(8, glm::dvec3(0, 0, 1)), {2 * mu, 0, -2}},
      {"corner of 90 degrees", {{1, 0, 1}, {-1, 0, 1}}, {0.1, 2 * mu * std::numbers::sqrt2, -2}},
      {"groove of 60 degrees", {{0.866, 0, 0.5}, {-0.866, 0, 0.5}}, {0.1, 4 * mu, -2}},
      {"three walls", {{1, 0.1, 0.8}, {-0.9, 0.5, 0.7}, {0.1, -1, 0.9}}, {0.1, 0.1, -2}}};
  for (const Case& c : cases) {
    RowLoop loop = loop_with();
    const Scene scene = planes(c.normals);
    std::mt19937 random(5);
    std::normal_distribution<> normal;
    glm::dvec3 trembles_m{0}, begun_m{0}, ended_m{0};
    constexpr int kMean = 2000, kFrom = 66000, kTo = kFrom + 60'000;
    for (int i = 0; i < kTo + kMean; ++i) {
      trembles_m += 0.05 * (4e-5 * glm::dvec3(normal(random), normal(random), normal(random)) - trembles_m);
      // Through the coupling and the pad, alike in all directions.
      const glm::dvec3 asked_m = 1.5e-3 * c.load_N * std::min(1.0, i / 500.0);
      loop.tick(at(asked_m + trembles_m), scene);
      if (i >= kFrom && i < kFrom + kMean) begun_m += loop.touching().X_WP.p / double(kMean);
      if (i >= kTo) ended_m += loop.touching().X_WP.p / double(kMean);
    }
    out.push_back({"holds still for 60 s: " + c.name, glm::length(ended_m - begun_m), 1e-8, "m", loop.step_us()});
  }
}

/// A box on four corners, at half of what friction holds sideways and half of what it holds turning. Nothing of the pad
/// turns, so all of its turning has to be held at once.
void add_held_box(std::vector<MechanismRow>& out) {
  constexpr double kHalf_m = 0.01, kPress_N = 2, kShare = 0.5;
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        rows.push_back(
            test_support::point_on_plane(X_WQ, {x * kHalf_m, y * kHalf_m, 0}, {0, 0, 1}, 0, {.friction = kFriction}));
    test_support::name_in_order(rows);
  };
  RowLoop loop = loop_with();
  std::mt19937 random(5);
  std::normal_distribution<> normal;
  const double side_N = 0.5 * kShare * kFriction * kPress_N;
  const double turn_Nm = 0.5 * kShare * kFriction * kPress_N * kHalf_m * std::numbers::sqrt2;
  glm::dvec3 trembles_m{0}, begun_m{0}, ended_m{0};
  constexpr int kMean = 2000, kFrom = 6000, kTo = kFrom + 60'000;
  for (int i = 0; i < kTo + kMean; ++i) {
    trembles_m += 0.05 * (4e-5 * glm::dvec3(normal(random), normal(random), normal(random)) - trembles_m);
    const double share = std::min(1.0, i / 500.0);
    const glm::dvec3 asked_rad{0, 0, share * turn_Nm / kMechanismGains.rotational_stiffness_Nm_per_rad};
    loop.tick(
        {spatial::rotation_from_vector(asked_rad), 1.5e-3 * share * glm::dvec3(side_N, 0, -kPress_N) + trembles_m},
        scene);
    const Pose& X_WP = loop.touching().X_WP;
    const glm::dvec3 corner_m = spatial::transform_point(X_WP, {kHalf_m, kHalf_m, 0}) / double(kMean);
    if (i >= kFrom && i < kFrom + kMean) begun_m += corner_m;
    if (i >= kTo) ended_m += corner_m;
  }
  out.push_back(
      {"holds still for 60 s: box on four corners", glm::length(ended_m - begun_m), 1e-8, "m", loop.step_us()});
  out.push_back({"box on four corners: friction holds its turning",
                 std::abs(spatial::vector_from_rotation(loop.touching().X_WP.R).z) * kHalf_m, 1e-6, "m",
                 loop.step_us()});
}

/// Pushed in with F, let go, pulled with 0.15 F. It locks below atan mu, and then F = 2 l (sin a + mu cos a).
void add_wedges(std::vector<MechanismRow>& out) {
  const double half_angle = std::numbers::pi / 18;
  for (const double push_N : {5.0, 30.0}) {
    RowLoop loop = loop_with();
    const Scene scene =
        planes({{std::cos(half_angle), 0, std::sin(half_angle)}, {-std::cos(half_angle), 0, std::sin(half_angle)}});
    double most_N = 0, in_m = 0;
    const auto go = [&](double from_N, double to_N) {
      for (int i = 0; i <= 500; ++i) {
        const double force_N = from_N + (to_N - from_N) * i / 500;
        loop.tick(at(loop.touching().tool.X_WT.p + glm::dvec3(0, 0, force_N / kMechanismGains.stiffness_N_per_m)),
                  scene);
        most_N = std::max(most_N, loop.touching().memory.forces[0].normal_N);
      }
    };
    go(0, -push_N);
    go(-push_N, -push_N);
    in_m = loop.touching().X_WP.p.z;
    const double jammed_N = loop.touching().memory.forces[0].normal_N;
    go(-push_N, 0);
    go(0, 0.15 * push_N);
    go(0.15 * push_N, 0.15 * push_N);
    const std::string name = push_N > 10 ? "wedge pushed with 30 N" : "wedge pushed with 5 N";
    const double closed_N = push_N / (2 * (std::sin(half_angle) + kFriction * std::cos(half_angle)));
    out.push_back(
        {name + ": presses F / 2(sin a + mu cos a)", std::abs(jammed_N / closed_N - 1), 0.05, "1", loop.step_us()});
    out.push_back({name + ": way out when pulled", loop.touching().X_WP.p.z - in_m, 20e-6, "m", loop.step_us()});
  }
}

/// A patch of 5 mm that is pressed evenly holds (2/3) mu N R of turning.
void add_drilling(std::vector<MechanismRow>& out) {
  constexpr double kPatch_m = 5e-3;
  RowLoop loop = loop_with();
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0, {.friction = kFriction}));
    rows.back().patch_radius_m = kPatch_m;
  };
  double most_Nm = 0;
  for (int i = 0; i < 2500; ++i) {
    const double turn_rad = 1e-3 * std::max(0.0, i * kTick_s - 0.5);
    loop.tick({spatial::rotation_from_vector({0, 0, turn_rad}), {0, 0, -3e-3 * std::min(1.0, i / 500.0)}}, scene);
    most_Nm = std::max(most_Nm, std::abs(loop.on_hand().torque_Nm.z));
  }
  const double closed_Nm = 2.0 / 3 * kFriction * loop.normal_sum_N() * kPatch_m;
  out.push_back(
      {"patch of 5 mm turned: holds (2/3) mu N R", std::abs(most_Nm / closed_Nm - 1), 0.02, "1", loop.step_us()});
}

}  // namespace

void add_friction(std::vector<MechanismRow>& out) {
  add_slopes(out);
  add_drifts(out);
  add_held_box(out);
  add_wedges(out);
  add_drilling(out);
}

/// Eleven contacts at random, a quarter of them apart; each tick's whole step: matrix, rows, pad, friction, proxy.
void add_solve_times(std::vector<MechanismRow>& out) {
  constexpr double kMost_us = 10;
  constexpr int kContacts = 11, kTicks = 20'000;
  struct Case {
    std::string name;
    bool is_cold;
    double friction;
    bool is_goal;
  };
  for (const Case& c :
       {Case{"step of 11 contacts, cold: p99", true, 0, true}, Case{"step of 11 contacts, warm: p99", false, 0, true},
        Case{"step of 11 contacts with friction, cold: p99", true, 0.3, false},
        Case{"step of 11 contacts with friction, warm: p99", false, 0.3, false}}) {
    std::mt19937 random(11);
    std::normal_distribution<> normal;
    const auto normal3 = [&](double size) { return size * glm::dvec3(normal(random), normal(random), normal(random)); };
    std::vector<double> step_us;
    for (int i = 0; i < kTicks;) {
      RowLoop loop = loop_with();
      std::vector<glm::dvec3> places, normals;
      std::vector<double> heights_m;
      for (int k = 0; k < kContacts; ++k) {
        places.push_back(normal3(0.02));
        normals.push_back(glm::normalize(normal3(1) + glm::dvec3(0, 0, 1)));
        heights_m.push_back(glm::dot(normals.back(), places.back()) + 1e-4 * (normal(random) + 0.7));
      }
      const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
        for (int k = 0; k < kContacts; ++k)
          rows.push_back(
              test_support::point_on_plane(X_WQ, places[k], normals[k], heights_m[k], {.friction = c.friction}));
        test_support::name_in_order(rows);
      };
      for (int tick = 0; tick < (c.is_cold ? 1 : 20); ++tick, ++i) loop.tick(at({0, 0, -1e-3 - 1e-4 * tick}), scene);
      step_us.insert(step_us.end(), loop.step_us().begin(), loop.step_us().end());
    }
    std::vector<double> sorted = step_us;
    std::sort(sorted.begin(), sorted.end());
    out.push_back({c.name, sorted[sorted.size() * 99 / 100], kMost_us, "us", step_us, c.is_goal});
  }
}

}  // namespace farfeel::bench
