#include "haptic_core/motion/moving_objects.h"

#include <gtest/gtest.h>

namespace farfeel::motion {
namespace {

using spatial::Pose;
using spatial::transform_point;

ScriptedMotion swing() {
  const std::vector<Keyframe> keys{{0, {{1, 0, 0, 0}, {0.02, 0, 0}}},
                                   {0.5, {spatial::rotation_from_vector({0, 0.4, 1}), {0.05, 0.01, 0}}},
                                   {1, {{1, 0, 0, 0}, {0.02, 0, 0}}}};
  return {keys, Afterwards::kRepeats};
}

TEST(MovingObjects, CarryAPointAlong) {
  const ScriptedMotion script = swing();
  MovingObjects objects({{3, script}});
  EXPECT_EQ(objects.find(2), nullptr);
  const glm::dvec3 p_O{0.03, -0.02, 0.05};
  objects.go_to(0.1);
  EXPECT_EQ(objects.find(3)->way_W, Pose{});
  const glm::dvec3 begin_W = transform_point(script.at(0.1).X_WO, p_O);
  glm::dvec3 p_W = begin_W;
  for (double s = 0.1; s < 2.3; s += 0.001) {
    objects.go_to(s);
    const Moved& moved = *objects.find(3);
    p_W = transform_point(moved.way_W, p_W);
    ASSERT_LT(glm::distance(p_W, transform_point(script.at(s).X_WO, p_O)), 1e-9);
    ASSERT_LT(glm::distance(p_W, transform_point(objects.way_since(moved, 0.1), begin_W)), 1e-9);
    const glm::dvec3 next_W = transform_point(script.at(s + 1e-6).X_WO, p_O);
    ASSERT_LT(glm::distance(1e6 * (next_W - p_W), moved.twist_at(p_W).linear_m_s), 1e-4);
  }
}

}  // namespace
}  // namespace farfeel::motion
