#include "codecs/device/wooden_haptics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "haptic_core/spatial/spatial.h"
#include "tests/support/devices/wooden_haptics_emulator.h"

using namespace farfeel::codecs;
using farfeel::spatial::is_finite;
using farfeel::test_support::WoodenHapticsEmulator;

namespace {

constexpr double kRightAngle_rad = std::numbers::pi / 2;

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> b;
  for (const int v : values) b.push_back(static_cast<std::byte>(v));
  return b;
}

std::vector<std::byte> bytes(const WoodenHapticsPacket& packet) {
  return {packet.begin(), packet.end()};
}

glm::dvec3 some_angles(std::mt19937& random) {
  const WoodenHapticsArm arm;
  std::uniform_real_distribution<double> share(0, 1);
  return glm::mix(arm.min_angle_rad, arm.max_angle_rad, glm::dvec3(share(random), share(random), share(random)));
}

TEST(WoodenHaptics, PacketsAreThoseOfTheTables) {
  EXPECT_EQ(bytes(wooden_haptics_currents({1000, -1000, 1})),
            bytes({0, 0xE8, 0x03, 0x18, 0xFC, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bytes(wooden_haptics_counts({0, -1, 6000, 1, 2, 3})),
            bytes({0, 1, 0, 2, 0, 3, 0, 1, 0, 0, 0, 0xFF, 0xFF, 0x70, 0x17}));
  const auto answer = read_wooden_haptics(bytes({0, 1, 0, 0xFE, 0xFF, 0x70, 0x17, 4, 0, 5, 0, 6, 0, 1, 0}));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->counts, (std::array<std::int16_t, 6>{1, -2, 6000, 4, 5, 6}));
  EXPECT_TRUE(answer->asks_to_home);
}

TEST(WoodenHaptics, OnlyWholeAnswersAreRead) {
  std::vector<std::byte> report(kWoodenHapticsReportBytes);
  EXPECT_TRUE(read_wooden_haptics(report));
  EXPECT_FALSE(read_wooden_haptics(report)->asks_to_home);
  for (std::size_t size = 0; size < report.size(); ++size) {
    EXPECT_FALSE(read_wooden_haptics(std::span(report).first(size)));
  }
  report.push_back(std::byte{0});
  EXPECT_FALSE(read_wooden_haptics(report)) << "too long";
  report.pop_back();
  report[0] = std::byte{1};
  EXPECT_FALSE(read_wooden_haptics(report)) << "another report";
}

// Poses that a ruler can check.
TEST(WoodenHaptics, PlacesInClosedForm) {
  const WoodenHapticsArm arm;
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-12; };
  const glm::dvec3 neutral = body_angles_rad(arm, arm.neutral_counts);
  EXPECT_TRUE(near(neutral, {0, 0, kRightAngle_rad}));
  EXPECT_TRUE(can_reach(arm, neutral));
  // 245 mm ahead and 285 mm up, less the origin at 220 mm ahead and 80 mm up. Ahead is towards the person: -y.
  EXPECT_TRUE(near(handle_B_m(arm, neutral), {0, -0.025, 0.205}));
  // Upper arm level, too: stretched straight ahead.
  EXPECT_TRUE(near(handle_B_m(arm, {0, kRightAngle_rad, kRightAngle_rad}), {0, -0.230, 0}));
  // The whole arm turned to the right.
  EXPECT_TRUE(near(handle_B_m(arm, {kRightAngle_rad, kRightAngle_rad, kRightAngle_rad}), {0.450, 0.220, 0}));
  // Forearm straight down beside the upright upper arm: over the base.
  EXPECT_TRUE(near(handle_B_m(arm, {0.3, 0, 0}), {0, 0.220, -0.040}));
}

TEST(WoodenHaptics, PlacesAreThoseOfTurnsOneAfterTheOther) {
  std::mt19937 random(3);
  const WoodenHapticsArm arm;
  WoodenHapticsEmulator device;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 angles = some_angles(random);
    device.put_at({angles.x, angles.y, angles.z});
    const Eigen::Vector3d p = device.handle_B_m();
    ASSERT_LT(glm::length(handle_B_m(arm, angles) - glm::dvec3(p.x(), p.y(), p.z())), 1e-12);
  }
}

TEST(WoodenHaptics, TheJacobianIsTheDerivative) {
  std::mt19937 random(4);
  const WoodenHapticsArm arm;
  constexpr double kSmall_rad = 1e-6;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 angles = some_angles(random);
    const glm::dmat3 J = handle_jacobian_B(arm, angles);
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 d(0);
      d[axis] = kSmall_rad;
      const glm::dvec3 by_difference = (handle_B_m(arm, angles + d) - handle_B_m(arm, angles - d)) / (2 * kSmall_rad);
      ASSERT_LT(glm::length(J[axis] - by_difference), 1e-9);
    }
  }
}

// The other implementation turns currents into a force by virtual work; ours must have asked for the right ones.
TEST(WoodenHaptics, CurrentsMakeTheForceThatWasAskedFor) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> force(-1, 1);
  const WoodenHapticsArm arm;
  WoodenHapticsEmulator device;
  int checked = 0;
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 angles = some_angles(random);
    if (std::abs(glm::determinant(handle_jacobian_B(arm, angles))) < 2e-3) continue;  // near a singular pose
    const glm::dvec3 F(force(random), force(random), force(random));
    device.put_at({angles.x, angles.y, angles.z});
    device.take_output(wooden_haptics_currents(motor_currents_mA(arm, angles, F)), 1);
    const Eigen::Vector3d felt = device.motor_force_B_N();
    // A milliampere is at most 4.2e-4 Nm of a body, at a lever of some centimetres.
    ASSERT_LT(glm::length(F - glm::dvec3(felt.x(), felt.y(), felt.z())), 0.03);
    ++checked;
  }
  EXPECT_GT(checked, 300);
}

TEST(WoodenHaptics, TooMuchForceKeepsItsDirection) {
  const WoodenHapticsArm arm;
  const glm::dvec3 angles(0.2, 0.3, 1.3);
  const auto currents = motor_currents_mA(arm, angles, {30, -50, 20});
  const auto tenth = motor_currents_mA(arm, angles, {0.6, -1, 0.4});
  int greatest = 0;
  for (std::size_t i = 0; i < 3; ++i) greatest = std::max(greatest, std::abs(currents[i]));
  EXPECT_LE(greatest, 2000);
  EXPECT_GE(greatest, 1999);
  const double ratio = static_cast<double>(currents[0]) / tenth[0];
  for (std::size_t i = 1; i < 3; ++i) EXPECT_NEAR(currents[i], ratio * tenth[i], 2 * ratio);
}

TEST(WoodenHaptics, EveryPoseAndForceHasFiniteCurrents) {
  const WoodenHapticsArm arm;
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const glm::dvec3 singular[] = {{0, 0, 0},                               // over the base
                                 {0, kRightAngle_rad, kRightAngle_rad},   // stretched
                                 {0, kRightAngle_rad, -kRightAngle_rad},  // folded
                                 {1, 0, std::numbers::pi}};               // straight up
  for (const glm::dvec3& angles : singular) {
    EXPECT_LT(std::abs(glm::determinant(handle_jacobian_B(arm, angles))), 1e-9);
    for (const glm::dvec3& F : {glm::dvec3(1e300), glm::dvec3(5, -5, 5), glm::dvec3(-1e-300)}) {
      for (const std::int16_t mA : motor_currents_mA(arm, angles, F)) EXPECT_LE(std::abs(mA), 2000);
    }
  }
  for (const double bad : {inf, -inf, nan}) {
    EXPECT_EQ(motor_currents_mA(arm, {0, 0.3, 1}, {0, bad, 0}), (std::array<std::int16_t, 3>{}));
    EXPECT_EQ(motor_currents_mA(arm, {0, bad, 1}, {0, 1, 0}), (std::array<std::int16_t, 3>{}));
  }
  for (const int count : {-32768, -1, 0, 1, 32767}) {
    const auto c = static_cast<std::int16_t>(count);
    const glm::dvec3 angles = body_angles_rad(arm, {c, c, c, c, c, c});
    EXPECT_TRUE(is_finite(angles));
    EXPECT_TRUE(is_finite(handle_B_m(arm, angles)));
  }
  EXPECT_FALSE(can_reach(arm, body_angles_rad(arm, {0, 0, 32767, 0, 0, 0})));
}

}  // namespace
