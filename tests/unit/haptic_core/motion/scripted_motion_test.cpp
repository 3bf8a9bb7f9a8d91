#include "haptic_core/motion/scripted_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace farfeel::motion {
namespace {

using spatial::Pose;

Pose turned(double angle_rad, const glm::dvec3& axis = {0, 0, 1}) {
  return {spatial::rotation_from_vector(angle_rad * axis), {0, 0, 0}};
}

double angle_rad(const glm::dquat& a, const glm::dquat& b) {
  return glm::length(spatial::vector_from_rotation(a * glm::conjugate(b)));
}

std::vector<Keyframe> random_keys(std::mt19937& random, std::size_t count, bool closed) {
  std::uniform_real_distribution<double> place(-0.1, 0.1), turn(-1.5, 1.5), gap(0.05, 1);
  std::vector<Keyframe> keys;
  double at_s = 0.2;
  for (std::size_t i = 0; i < count; ++i, at_s += gap(random)) {
    const glm::dvec3 w{turn(random), turn(random), turn(random)};
    keys.push_back({at_s, {spatial::rotation_from_vector(w), {place(random), place(random), place(random)}}});
  }
  if (closed) keys.back().X_WO = keys.front().X_WO;
  return keys;
}

TEST(ScriptedMotion, GoesThroughItsKeys) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    const auto keys = random_keys(random, 5, false);
    const ScriptedMotion motion(keys, Afterwards::kStays);
    for (const Keyframe& key : keys) {
      const Placement there = motion.at(key.at_s);
      EXPECT_LT(glm::distance(there.X_WO.p, key.X_WO.p), 1e-12);
      EXPECT_LT(angle_rad(there.X_WO.R, key.X_WO.R), 1e-7);
    }
  }
}

TEST(ScriptedMotion, VelocityIsTheDerivativeAndContinuous) {
  std::mt19937 random(2);
  constexpr double kStep_s = 1e-5;
  for (const bool closed : {false, true}) {
    for (int round = 0; round < 20; ++round) {
      const auto keys = random_keys(random, 6, closed);
      const ScriptedMotion motion(keys, closed ? Afterwards::kRepeats : Afterwards::kStays);
      const double end_s = keys.back().at_s + 1;
      for (double s = 0.001; s < end_s; s += 0.00731) {
        const Placement before = motion.at(s - kStep_s), here = motion.at(s), after = motion.at(s + kStep_s);
        const glm::dvec3 v = (after.X_WO.p - before.X_WO.p) / (2 * kStep_s);
        const glm::dvec3 w =
            spatial::vector_from_rotation(after.X_WO.R * glm::conjugate(before.X_WO.R)) / (2 * kStep_s);
        // Where acceleration jumps, at a key, the difference quotient is off by that times the step.
        EXPECT_LT(glm::distance(v, here.V_WO_W.linear_m_s), 5e-3) << s;
        EXPECT_LT(glm::distance(w, here.V_WO_W.angular_rad_s), 2e-2) << s;
        EXPECT_LT(glm::distance(after.V_WO_W.linear_m_s, before.V_WO_W.linear_m_s), 1e-2) << s;
        EXPECT_LT(glm::distance(after.V_WO_W.angular_rad_s, before.V_WO_W.angular_rad_s), 5e-2) << s;
      }
    }
  }
}

TEST(ScriptedMotion, EvenKeysOfATurnMakeASteadyTurn) {
  constexpr double kThird_rad = 2 * std::numbers::pi / 3;
  const std::vector<Keyframe> keys{
      {0, turned(0)}, {1, turned(kThird_rad)}, {2, turned(2 * kThird_rad)}, {3, turned(0)}};
  const ScriptedMotion motion(keys, Afterwards::kRepeats);
  for (double s = 0.01; s < 10; s += 0.037) {
    const Placement there = motion.at(s);
    EXPECT_LT(angle_rad(there.X_WO.R, turned(kThird_rad * s).R), 1e-7) << s;
    EXPECT_LT(glm::distance(there.V_WO_W.angular_rad_s, {0, 0, kThird_rad}), 1e-9) << s;
  }
}

TEST(ScriptedMotion, WaitsBeforeAndRestsAfterwards) {
  const std::vector<Keyframe> keys{{1, {{1, 0, 0, 0}, {0, 0, 0}}}, {2, {{1, 0, 0, 0}, {0.01, 0, 0}}}};
  const ScriptedMotion motion(keys, Afterwards::kStays);
  for (const double s : {-1.0, 0.0, 1.0, 2.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    const Placement there = motion.at(s);
    EXPECT_EQ(there.V_WO_W.linear_m_s, glm::dvec3(0)) << s;
    EXPECT_DOUBLE_EQ(there.X_WO.p.x, s >= 2 ? 0.01 : 0) << s;
  }
  EXPECT_NEAR(motion.at(1.5).X_WO.p.x, 0.005, 1e-12);
}

TEST(ScriptedMotion, TellsWhatIsWrongWithAScript) {
  const Pose still;
  const Pose bad{{2, 0, 0, 0}, {0, 0, 0}};
  EXPECT_TRUE(fault_of(std::vector<Keyframe>{{0, still}}, Afterwards::kStays));
  EXPECT_TRUE(fault_of(std::vector<Keyframe>{{0, still}, {0, still}}, Afterwards::kStays));
  EXPECT_TRUE(fault_of(std::vector<Keyframe>{{-1, still}, {1, still}}, Afterwards::kStays));
  EXPECT_TRUE(fault_of(std::vector<Keyframe>{{0, still}, {1, bad}}, Afterwards::kStays));
  EXPECT_TRUE(fault_of(std::vector<Keyframe>{{0, still}, {1, turned(0.1)}}, Afterwards::kRepeats));
  EXPECT_TRUE(fault_of(std::vector<Keyframe>(kMostKeyframes + 1), Afterwards::kStays));
  EXPECT_FALSE(fault_of(std::vector<Keyframe>{{0, still}, {1, turned(0.1)}}, Afterwards::kStays));
  EXPECT_FALSE(fault_of(std::vector<Keyframe>{{0, still}, {1, turned(0.1)}, {2, still}}, Afterwards::kRepeats));
}

}  // namespace
}  // namespace farfeel::motion
