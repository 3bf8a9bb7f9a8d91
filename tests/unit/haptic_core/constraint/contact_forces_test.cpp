// Friction at the proxy: where it lets go, that it holds still, and which way it drags.
#include "haptic_core/constraint/contact_forces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/row_loop.h"

namespace farfeel::constraint {
namespace {

using spatial::Pose;
using test_support::RowLoop;
using test_support::Scene;

constexpr tool::CouplingGains kGains{2000, 1, 5, 0.005};
constexpr double kTick_s = 1e-3;

Scene planes(const std::vector<glm::dvec3>& normals, double friction) {
  return [normals, friction](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const glm::dvec3& n : normals)
      rows.push_back(test_support::point_on_plane(X_WQ, {}, glm::normalize(n), 0, {.friction = friction}));
    test_support::name_in_order(rows);
  };
}

Pose at(const glm::dvec3& p) {
  return {{1, 0, 0, 0}, p};
}

/// How far a free tool goes in two seconds under 1 N down a slope.
double way_down_m(double slope, double friction, int copies) {
  RowLoop loop({}, kGains, one_pad(0), kTick_s, {});
  const glm::dvec3 nhat{std::sin(slope), 0, std::cos(slope)};
  const Scene scene = planes(std::vector(copies, nhat), friction);
  for (int i = 0; i < 1000; ++i) loop.push({0, 0, -std::min(1.0, i / 500.0)}, scene);
  const glm::dvec3 from = loop.touching().X_WP.p;
  for (int i = 0; i < 2000; ++i) loop.push({0, 0, -1}, scene);
  return glm::length(loop.touching().X_WP.p - from);
}

TEST(ContactForces, AToolSlidesWhereTheSlopeIsSteeperThanFriction) {
  for (const int copies : {1, 8}) {
    EXPECT_LE(way_down_m(0.99 * std::atan(0.3), 0.3, copies), 1e-7) << copies;
    EXPECT_GE(way_down_m(1.01 * std::atan(0.3), 0.3, copies), 0.01) << copies;
  }
}

TEST(ContactForces, WhatSticksStaysForAsLongAsItIsHeld) {
  std::mt19937 random(5);
  std::normal_distribution<> normal;
  for (const std::vector<glm::dvec3>& normals : {std::vector<glm::dvec3>{{0, 0, 1}},
                                                 std::vector<glm::dvec3>(8, {0, 0, 1}),
                                                 {{1, 0, 1}, {-1, 0, 1}},
                                                 {{1, 0.1, 0.8}, {-0.9, 0.5, 0.7}, {0.1, -1, 0.9}}}) {
    RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
    const Scene scene = planes(normals, 0.3);
    glm::dvec3 trembling_m{0}, begun_m{0}, ended_m{0};
    constexpr int kMean = 2000;
    // Where three walls share a load, this shifts from one to the other for some seconds.
    for (int i = 0; i < 14'000; ++i) {
      trembling_m += 0.05 * (4e-5 * glm::dvec3(normal(random), normal(random), normal(random)) - trembling_m);
      const double pressed = std::min(1.0, i / 500.0);
      loop.tick(at(pressed * glm::dvec3(0.1e-3, 0.05e-3, -3e-3) + trembling_m), scene);
      if (i >= 6000 && i < 6000 + kMean) begun_m += loop.touching().X_WP.p / double(kMean);
      if (i >= 12'000) ended_m += loop.touching().X_WP.p / double(kMean);
    }
    EXPECT_LE(glm::length(ended_m - begun_m), 1e-8) << normals.size();
  }
}

TEST(ContactForces, WhatSticksStaysWhereRowsBlinkAndMaterialsDiffer) {
  std::mt19937 random(4);
  for (const bool blinks : {true, false}) {
    RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
    std::array<bool, 8> is_there{};
    const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      for (std::size_t i = 0; i < is_there.size(); ++i) {
        const glm::dvec3 nhat = blinks || i % 2 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 0.6, 0.8);
        if (i > 0 && blinks && !is_there[i]) continue;
        rows.push_back(test_support::point_on_plane(
            X_WQ, {}, nhat, 0, {.stiffness_N_per_m = blinks ? 1000 : 500 + 200.0 * double(i), .friction = 0.3}));
        rows.back().name = i + 1;
      }
    };
    glm::dvec3 begun_m{0};
    for (int i = 0; i < 10'000; ++i) {
      if (i % 5 == 0)
        for (bool& there : is_there) there = random() & 1;
      loop.tick(at(std::min(1.0, i / 500.0) * glm::dvec3(0.6e-3, 0, -3e-3)), scene);
      if (i == 2000) begun_m = loop.touching().X_WP.p;
    }
    // 1,600 times other rows: each may slip by what the joints of a row yield that comes, 0.1 nm.
    EXPECT_LE(glm::length(loop.touching().X_WP.p - begun_m), blinks ? 2e-7 : 1e-8);
  }
}

TEST(ContactForces, DragsAgainstTheMotionAndHoldsMoreAtRest) {
  RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0, {.friction = 0.3}));
    rows.back().dynamic_friction = 0.2;
  };
  double most_held = 0;
  for (int i = 0; i < 3000; ++i) {
    const glm::dvec3 way = 1e-3 * std::max(0.0, i * kTick_s - 0.5) * glm::dvec3(3, 4, 0);
    loop.tick(at(way + glm::dvec3(0, 0, -3e-3 * std::min(1.0, i / 500.0))), scene);
    const RowForce& force = loop.touching().memory.forces[0];
    if (force.normal_N > 0) most_held = std::max(most_held, glm::length(force.friction_W) / force.normal_N);
  }
  const RowForce& force = loop.touching().memory.forces[0];
  EXPECT_TRUE(force.is_sliding);
  EXPECT_NEAR(glm::length(force.friction_W), 0.2 * force.normal_N, 1e-9);
  EXPECT_NEAR(glm::dot(glm::normalize(force.friction_W), glm::dvec3(-0.6, -0.8, 0)), 1, 1e-6);
  EXPECT_NEAR(most_held, 0.3, 0.001);
}

TEST(ContactForces, APatchHoldsTurningByTwoThirdsOfItsRadius) {
  RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0, {.friction = 0.3}));
    rows.back().patch_radius_m = 5e-3;
  };
  for (int i = 0; i < 3000; ++i) {
    const double turned_rad = 0.01 * std::max(0.0, i * kTick_s - 0.5);
    loop.tick({spatial::rotation_from_vector({0, 0, turned_rad}), {0, 0, -3e-3 * std::min(1.0, i / 500.0)}}, scene);
    const RowForce& force = loop.touching().memory.forces[0];
    const double most_Nm = 0.3 * force.normal_N * 5e-3 * 2 / 3;
    const double asked_Nm = kGains.rotational_stiffness_Nm_per_rad * turned_rad;
    ASSERT_LE(std::abs(force.torsion_Nm), most_Nm * (1 + 1e-9));
    if (i > 600 && asked_Nm < 0.9 * most_Nm) {
      ASSERT_FALSE(force.is_sliding) << i;
      ASSERT_NEAR(force.torsion_Nm, -asked_Nm, 0.03 * most_Nm);
    }
    if (asked_Nm > 1.5 * most_Nm) {
      ASSERT_NEAR(force.torsion_Nm, -most_Nm, 1e-6);
    }
  }
}

TEST(ContactForces, AWedgeHoldsBelowItsAngleOfFriction) {
  for (const bool is_steep : {true, false}) {
    const double half_angle = (is_steep ? 10.0 : 25.0) * M_PI / 180;  // it locks below atan 0.3 = 16.7 degrees
    RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
    const Scene scene = planes(
        {{std::cos(half_angle), 0, std::sin(half_angle)}, {-std::cos(half_angle), 0, std::sin(half_angle)}}, 0.3);
    const auto press = [&](double from_N, double to_N) {
      for (int i = 0; i <= 500; ++i) {
        const double force_N = from_N + (to_N - from_N) * i / 500;
        loop.tick(at(loop.touching().tool.X_WT.p + glm::dvec3(0, 0, force_N / kGains.stiffness_N_per_m)), scene);
      }
    };
    press(0, -5);
    press(-5, -5);
    const double pressed_N = loop.normal_sum_N();
    press(-5, 0);
    press(0, 0.75);
    press(0.75, 0.75);
    if (is_steep) {
      EXPECT_LE(loop.touching().X_WP.p.z, 20e-6);
      EXPECT_GE(loop.normal_sum_N(), 0.2 * pressed_N);  // it still squeezes
    } else {
      EXPECT_GE(loop.touching().X_WP.p.z, 1e-3);
    }
  }
}

/// Four corners, half of what friction holds sideways and half of what it holds turning, neither of which a pad shows.
TEST(ContactForces, WhatTurnsIsHeldByAllCornersAtOnce) {
  RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const double x : {-0.01, 0.01})
      for (const double y : {-0.01, 0.01})
        rows.push_back(test_support::point_on_plane(X_WQ, {x, y, 0}, {0, 0, 1}, 0, {.friction = 0.3}));
    test_support::name_in_order(rows);
  };
  for (int i = 0; i < 2000; ++i) {
    const double share = std::min(1.0, i / 500.0);
    loop.tick({spatial::rotation_from_vector({0, 0, share * 0.4e-3}), share * glm::dvec3(0.2e-3, 0, -3e-3)}, scene);
  }
  EXPECT_LE(0.01 * std::abs(spatial::vector_from_rotation(loop.touching().X_WP.R).z), 1e-6);
  EXPECT_NEAR(loop.on_hand().torque_Nm.z, -0.4e-3 * kGains.rotational_stiffness_Nm_per_rad, 1e-5);
}

/// Cells of walls at random, and a hand that shakes the tool in them: pushes and friction undo each other, and what is
/// not solved would grow. Friction may hold a tool there, never throw it.
TEST(ContactForces, FrictionThrowsNoToolAboutBetweenWallsThatJam) {
  for (const unsigned seed : {1u, 5u, 7u, 11u, 22u, 33u}) {
    double without_N = 0;
    for (const double friction : {0.0, 0.3, 0.8}) {
      std::mt19937 random(seed);
      std::normal_distribution<> normal;
      const auto normal3 = [&](double size) {
        return size * glm::dvec3(normal(random), normal(random), normal(random));
      };
      struct Wall {
        glm::dvec3 nhat, place;
        double stiffness_N_per_m;
      };
      std::vector<Wall> walls(6 + seed % 16);
      for (Wall& wall : walls)
        wall = {glm::normalize(normal3(1)), normal3(0.01), 1000 * std::exp(std::abs(normal(random)))};
      const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
        for (const Wall& wall : walls)
          rows.push_back(
              test_support::point_on_plane(X_WQ, wall.place, wall.nhat, glm::dot(wall.nhat, wall.place) - 0.2e-3,
                                           {.stiffness_N_per_m = wall.stiffness_N_per_m, .friction = friction}));
        test_support::name_in_order(rows);
      };
      RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
      double most_N = 0;
      for (int i = 0; i < 4000; ++i) {
        const double t = i * kTick_s;
        loop.tick({spatial::rotation_from_vector(0.02 * glm::dvec3(std::sin(5 * t), std::sin(9 * t), std::sin(8 * t))),
                   5e-3 * glm::dvec3(std::sin(7 * t), std::sin(11 * t), std::sin(13 * t))},
                  scene);
        most_N = std::max(most_N, glm::length(loop.on_hand().force_N));
      }
      if (friction == 0) without_N = most_N;
      EXPECT_LE(most_N, 2 * without_N) << seed << ' ' << friction;
    }
  }
}

TEST(ContactForces, ARowThatPushesItsMostIsToldAsSaturated) {
  RowLoop loop({}, kGains, one_pad(2000), kTick_s, {});
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0));
    rows.back().most_N = 2;
  };
  for (int i = 0; i < 1000; ++i) loop.tick(at({1e-3 * i, 0, -1e-2}), scene);
  EXPECT_TRUE(loop.touching().memory.forces[0].is_saturated);
  EXPECT_TRUE(loop.report().contacts.is_any_saturated);
  EXPECT_EQ(loop.touching().memory.forces[0].normal_N, 2);
  // The proxy is on the surface, and no longer goes along it.
  EXPECT_NEAR(loop.touching().X_WP.p.z, 0, 1e-8);
  const double stayed_m = loop.touching().X_WP.p.x;
  for (int i = 0; i < 100; ++i) loop.tick(at({1 + 1e-3 * i, 0, -1e-2}), scene);
  EXPECT_NEAR(loop.touching().X_WP.p.x, stayed_m, 1e-12);
}

}  // namespace
}  // namespace farfeel::constraint
