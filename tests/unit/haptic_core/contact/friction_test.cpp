#include "haptic_core/contact/friction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace farfeel::contact {
namespace {

constexpr FrictionLimits kLimits{.stiffness_N_per_m = 2000, .static_N = 1.2, .dynamic_N = 1.0};

/// A mass on the surface, moved by backward Euler under a force from outside.
struct Block {
  double mass_kg, dt_s;
  glm::dvec3 v{0}, p{0};
  Friction friction = {};
  glm::dvec3 friction_N{0};  ///< of the last step
  double work_in_J = 0;      ///< of friction on the block, negated: what went into friction

  void step(const glm::dvec3& push_N, const FrictionLimits& limits = kLimits) {
    const FrictionForce f = friction_force(friction, limits, v, dt_s);
    const double tangent = dt_s * f.by_displacement_N_per_m + f.by_velocity_Ns_per_m;
    // (m + h tangent) dv = h (push + force at the step's beginning, carried on with v)
    const glm::dvec3 dv =
        dt_s * (push_N + f.force_W - dt_s * f.by_displacement_N_per_m * v) / (mass_kg + dt_s * tangent);
    v += dv;
    friction_N = f.force_W - f.by_velocity_Ns_per_m * dv - dt_s * f.by_displacement_N_per_m * v;
    p += dt_s * v;
    work_in_J -= glm::dot(friction_N, dt_s * v);
    slide(friction, limits, dt_s * v);
  }
};

TEST(FrictionTest, LimitsFollowTheNormalForce) {
  const Material material{.stiffness_N_per_m = 1000, .static_friction = 0.4, .dynamic_friction = 0.3};
  const FrictionLimits limits = friction_limits(material, 5, 0.5);
  EXPECT_DOUBLE_EQ(limits.static_N, 2);
  EXPECT_DOUBLE_EQ(limits.dynamic_N, 1.5);
  EXPECT_DOUBLE_EQ(limits.stiffness_N_per_m, kTangentialShare * 500);
  const FrictionLimits odd = friction_limits({.static_friction = 0.1, .dynamic_friction = 0.3}, 1);
  EXPECT_DOUBLE_EQ(odd.static_N, odd.dynamic_N) << "a static limit below the dynamic one would chatter";
}

TEST(FrictionTest, HoldsBelowTheStaticLimitWithoutCreep) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double mass_kg : {0.001, 0.02, 0.1}) {
    Block block{mass_kg, 1e-3};
    glm::dvec3 held{0};
    for (int i = 0; i < 20'000; ++i) {
      const double now = std::min(1.0, i / 500.0);  // the load is put on slowly, then jitters
      block.step({1.1 * now + 0.04 * uniform(random), 0.04 * uniform(random), 0});
      if (i == 2000) held = block.p;
    }
    EXPECT_FALSE(block.friction.is_sliding) << mass_kg;
    EXPECT_LT(glm::distance(block.p, held), 0.1e-3) << mass_kg;  // the spring's own give under the jitter
    for (int i = 0; i < 5000; ++i) block.step({0, 0, 0});
    EXPECT_LT(glm::length(block.p), 1e-9) << "let go, it returns to where it was: nothing crept";
  }
}

TEST(FrictionTest, SlidesWithTheDynamicForceAtAnySpeedAndTick) {
  for (const double dt_s : {1e-3, 2e-4}) {
    for (const double speed : {1e-4, 1e-3, 1e-2, 0.1, 1.0}) {
      Block block{1e6, dt_s};  // so heavy that its speed stays
      block.v = {0.6 * speed, 0.8 * speed, 0};
      const int ticks = static_cast<int>(std::ceil(3e-3 / speed / dt_s)) + 3;
      double greatest_N = 0;
      for (int i = 0; i < ticks; ++i) {
        block.step({});
        greatest_N = std::max(greatest_N, glm::length(block.friction_N));
      }
      EXPECT_NEAR(glm::length(block.friction_N), kLimits.dynamic_N, 1e-3) << speed << " m/s, " << dt_s;
      EXPECT_LT(glm::dot(block.friction_N, block.v), 0);
      EXPECT_LE(greatest_N, kLimits.static_N + 1e-9);
      // Before it breaks away it is held to the static limit, as far as one step does not go beyond.
      if (speed * dt_s * kLimits.stiffness_N_per_m < 0.02) {
        EXPECT_GE(greatest_N, kLimits.static_N - 0.02);
      }
    }
  }
}

TEST(FrictionTest, NeverGivesMoreThanItGot) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    Block block{std::pow(10, -3 + 2 * std::generate_canonical<double, 32>(random)), 1e-3};
    double pressing = 1;
    for (int i = 0; i < 2000; ++i) {
      pressing =
          std::clamp(pressing + 0.02 * normal(random), 0.0, 3.0);  // the normal force wanders to nothing and back
      const FrictionLimits limits{2000, 1.2 * pressing, pressing};
      slide(block.friction, limits, glm::dvec3(0));  // less to hold: what the spring gives up is lost
      block.step({2 * normal(random), 2 * normal(random), 0}, limits);
      // What a hard stop within one step may leave in the spring beyond the work, for as long as it lasts.
      const double bound_J = 0.5 * limits.dynamic_N * limits.dynamic_N / limits.stiffness_N_per_m;
      ASSERT_GE(block.work_in_J + bound_J, friction_energy_J(block.friction, limits)) << trial << ' ' << i;
      ASSERT_TRUE(std::isfinite(block.v.x));
    }
  }
}

TEST(FrictionTest, ASlowPullSticksAndSlipsBetweenItsTwoLimits) {
  // A block pulled through a soft spring: force rises to the static limit, falls, rises again.
  Block block{0.02, 2e-4};
  constexpr double kPull_N_per_m = 200, kSpeed_m_s = 0.005;
  int slips = 0;
  bool was_sliding = false;
  double greatest_N = 0;
  for (int i = 0; i < 50'000; ++i) {
    const double pulled_m = kSpeed_m_s * i * block.dt_s;
    block.step({kPull_N_per_m * (pulled_m - block.p.x), 0, 0});
    greatest_N = std::max(greatest_N, -block.friction_N.x);
    slips += block.friction.is_sliding && !was_sliding;
    was_sliding = block.friction.is_sliding;
  }
  EXPECT_NEAR(greatest_N, kLimits.static_N, 0.02);
  EXPECT_GT(slips, 10);  // one every (1.2 - 0.8) N / 200 N/m / 5 mm/s = 0.4 s at most often
  EXPECT_LT(slips, 60);
  EXPECT_NEAR(block.p.x, kSpeed_m_s * 10, 0.01);
}

TEST(FrictionTest, NothingToHoldIsNoForce) {
  Friction friction{{1e-3, 0, 0}, false};
  const FrictionLimits none{2000, 0, 0};
  slide(friction, none, {1e-3, 0, 0});
  EXPECT_EQ(friction_energy_J(friction, none), 0);
  EXPECT_EQ(friction_force(friction, none, {}, 1e-3).force_W, glm::dvec3(0));
  EXPECT_EQ(friction_force(friction, none, {0.1, 0, 0}, 1e-3).force_W, glm::dvec3(0));
  EXPECT_EQ(friction_force({}, {0, 1, 1}, {0.1, 0, 0}, 1e-3).force_W, glm::dvec3(0));
}

}  // namespace
}  // namespace farfeel::contact
