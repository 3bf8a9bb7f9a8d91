#include "codecs/device/falcon_kinematics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/devices/falcon_mechanism.h"

namespace farfeel::codecs {
namespace {

/// Where the grip goes: the published workspace, a ball of four inches.
std::vector<glm::dvec3> places() {
  std::mt19937 random(11);
  std::uniform_real_distribution<> within(-1, 1);
  std::vector<glm::dvec3> all;
  while (all.size() < 20'000) {
    glm::dvec3 v(within(random), within(random), within(random));
    const double length = glm::length(v);
    if (length > 1 || length == 0) continue;
    if (all.size() % 4 == 0) v /= length;  // at its edge
    all.push_back(kFalconMiddle_F_m + 0.0508 * v);
  }
  return all;
}

TEST(FalconKinematics, the_inverse_is_that_of_the_law_of_cosines) {
  double worst = 0;
  for (const glm::dvec3& p : places()) {
    const auto ours = falcon_angles(p), other = test_support::falcon_arm_angles(p);
    ASSERT_TRUE(ours && other);
    for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::abs((*ours)[i] - (*other)[i]));
  }
  RecordProperty("worst_rad", std::to_string(worst));
  EXPECT_LT(worst, 1e-9);
}

TEST(FalconKinematics, forward_undoes_inverse) {
  double worst_m = 0;
  for (const glm::dvec3& p : places()) {
    const auto back = falcon_position(falcon_angles(p).value());
    ASSERT_TRUE(back) << p.x << ' ' << p.y << ' ' << p.z;
    worst_m = std::max(worst_m, glm::distance(*back, p));
  }
  std::printf("forward after inverse, 20000 places: %.3g m at most\n", worst_m);
  EXPECT_LT(worst_m, 1e-12);
}

TEST(FalconKinematics, jacobian_is_that_of_finite_differences) {
  double worst = 0, least_volume = 1, least_lever = 1, most_gain = 0;
  for (const glm::dvec3& p : places()) {
    const auto angles = falcon_angles(p).value();
    const auto J = falcon_jacobian(p, angles);
    ASSERT_TRUE(J) << p.x << ' ' << p.y << ' ' << p.z;
    for (int i = 0; i < 3; ++i) {
      constexpr double kStep_rad = 1e-5;
      FalconAngles ahead = angles, behind = angles;
      ahead[static_cast<std::size_t>(i)] += kStep_rad, behind[static_cast<std::size_t>(i)] -= kStep_rad;
      const auto p_ahead = falcon_position(ahead), p_behind = falcon_position(behind);
      ASSERT_TRUE(p_ahead && p_behind);
      worst = std::max(worst, glm::distance((*p_ahead - *p_behind) / (2 * kStep_rad), (*J)[i]));
      most_gain = std::max(most_gain, glm::length((*J)[i]));
    }
    least_volume = std::min(least_volume, std::abs(glm::determinant(*J)));
    least_lever = std::min({least_lever, glm::length((*J)[0]), glm::length((*J)[1]), glm::length((*J)[2])});
  }
  std::printf("jacobian against differences: %.3g m/rad at most; columns %.4f to %.4f m/rad, determinant from %.3g\n",
              worst, least_lever, most_gain, least_volume);
  EXPECT_LT(worst, 1e-8);
}

TEST(FalconKinematics, motors_push_as_asked_by_virtual_work) {
  std::mt19937 random(5);
  std::uniform_real_distribution<> within(-1, 1);
  double worst = 0, least_share = 1;
  for (const glm::dvec3& p : places()) {
    const auto J = falcon_jacobian(p, falcon_angles(p).value());
    const glm::dvec3 force = 4.0 * glm::dvec3(within(random), within(random), within(random));
    const FalconMotors motors = falcon_motors(J.value(), force);
    least_share = std::min(least_share, motors.share);
    test_support::FalconMechanism mechanism({}, p);
    mechanism.set_motors(motors.values);
    worst = std::max(worst, glm::distance(mechanism.motor_force_F_N(), force * motors.share));
  }
  std::printf("force by virtual work against force asked for: %.4f N at most; least share %.3f\n", worst, least_share);
  EXPECT_LT(worst, 0.01);  // half a unit of each motor is 0.05 mNm, on levers from some 20 mm
}

TEST(FalconKinematics, too_much_force_keeps_its_direction) {
  const glm::dvec3 p(0.01, -0.02, 0.12);
  const auto J = falcon_jacobian(p, falcon_angles(p).value()).value();
  const glm::dvec3 force(30, -10, 50);
  const FalconMotors motors = falcon_motors(J, force);
  EXPECT_LT(motors.share, 1);
  test_support::FalconMechanism mechanism({}, p);
  mechanism.set_motors(motors.values);
  const glm::dvec3 given = mechanism.motor_force_F_N();
  EXPECT_GT(glm::dot(glm::normalize(given), glm::normalize(force)), 0.99999);
  for (const std::int16_t value : motors.values) EXPECT_LE(std::abs(value), 4096);
}

TEST(FalconKinematics, out_of_reach_is_refused_and_all_else_finite) {
  std::mt19937 random(17);
  std::uniform_real_distribution<> within(-0.4, 0.4), any(-7, 7);
  int reached = 0, refused = 0, jacobians = 0;
  for (int round = 0; round < 200'000; ++round) {
    const glm::dvec3 p(within(random), within(random), within(random));
    const auto angles = falcon_angles(p);
    (angles ? reached : refused)++;
    if (angles) {
      for (const double angle : *angles) ASSERT_TRUE(std::isfinite(angle));
      if (const auto J = falcon_jacobian(p, *angles)) {
        ++jacobians;
        for (int i = 0; i < 3; ++i) ASSERT_LT(glm::length((*J)[i]), 0.060 / kLeastVolume + 1e-12);
        for (const std::int16_t value : falcon_motors(*J, {1e300, 3, -4}).values) ASSERT_LE(std::abs(value), 4096);
      }
    }
    const FalconAngles turned{any(random), any(random), any(random)};
    if (const auto at = falcon_position(turned)) {
      const auto back = falcon_angles(*at);
      ASSERT_TRUE(back);
      for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR((*back)[i], turned[i], 1e-6);
    }
  }
  EXPECT_GT(reached, 1000);
  EXPECT_GT(refused, 1000);
  EXPECT_GT(jacobians, 1000);
}

TEST(FalconKinematics, singular_poses_are_refused) {
  // Straight out: where an arm lies in line with its shin, the reach ends.
  double z = 0.12;
  while (falcon_angles({0, 0, z})) z += 1e-5;
  const glm::dvec3 edge(0, 0, z - 1e-5);
  EXPECT_FALSE(falcon_jacobian(edge, falcon_angles(edge).value()));
  EXPECT_TRUE(falcon_angles({0, 0, 0.12}));
  EXPECT_FALSE(falcon_angles({0, 0, z + 0.01}));
  EXPECT_FALSE(falcon_angles({0.3, 0, 0.12}));
  EXPECT_FALSE(falcon_angles({0, 0, 0}));
  // All shins in the plane of their elbows: the grip cannot be told above from below.
  const FalconAngles down{-1.5, -1.5, -1.5};
  const auto at = falcon_position(down);
  EXPECT_FALSE(at && falcon_jacobian(*at, down));
}

TEST(FalconKinematics, what_is_no_number_is_refused) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const glm::dvec3 p(0, 0, 0.12);
  const auto angles = falcon_angles(p).value();
  const auto J = falcon_jacobian(p, angles).value();
  for (const double bad : {nan, inf, -inf, 1e200}) {
    EXPECT_FALSE(falcon_angles({bad, 0, 0.12}));
    EXPECT_FALSE(falcon_angles({0, 0, bad}));
    EXPECT_FALSE(falcon_position({bad, angles[1], angles[2]}) && !std::isfinite(std::sin(bad)));
    EXPECT_FALSE(falcon_jacobian({0, bad, 0.12}, angles));
    const FalconMotors motors = falcon_motors(J, {0, bad, 0});
    for (const std::int16_t value : motors.values) EXPECT_LE(std::abs(value), 4096);
  }
  EXPECT_EQ(falcon_motors(J, {nan, 0, 0}).values, (std::array<std::int16_t, 3>{}));
  EXPECT_EQ(falcon_motors(J, {inf, 0, 0}).share, 0);
}

TEST(FalconKinematics, every_count_that_an_encoder_can_tell_is_finite_or_refused) {
  std::mt19937 random(23);
  int known = 0;
  for (int round = 0; round < 100'000; ++round) {
    const auto count = [&] { return static_cast<std::int16_t>(random()); };
    const auto near = [&] { return static_cast<std::int16_t>(static_cast<int>(random() % 3000) - 1500); };
    const auto counts = round % 2 ? std::array{count(), count(), count()} : std::array{near(), near(), near()};
    const auto p = falcon_position(falcon_angles_of_counts(counts));
    if (!p) continue;
    ++known;
    ASSERT_LT(glm::length(*p), 0.3);
  }
  EXPECT_GT(known, 1000);
  EXPECT_NEAR(falcon_angles_of_counts({0, 1000, -1000})[1] * 180 / std::numbers::pi, 35 + 36.435, 0.001);
}

}  // namespace
}  // namespace farfeel::codecs
