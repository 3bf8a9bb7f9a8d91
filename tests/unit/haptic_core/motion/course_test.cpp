#include "haptic_core/motion/course.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "haptic_core/motion/moving_objects.h"

namespace farfeel::motion {
namespace {

using spatial::Pose;

Pose some_pose(std::mt19937_64& random) {
  std::uniform_real_distribution<> any(-1, 1);
  return {spatial::rotation_from_vector({any(random), any(random), any(random)}),
          {any(random), any(random), any(random)}};
}

Course from_to(const Pose& from, const Pose& to, double from_s, double takes_s, std::uint32_t version = 1) {
  return {.version = version, .from_s = from_s, .takes_s = takes_s, .X_from_WO = from, .X_to_WO = to};
}

double turn_rad(const Pose& a, const Pose& b) {
  return glm::length(spatial::vector_from_rotation(a.R * glm::conjugate(b.R)));
}

TEST(Course, BeginsAndEndsAtRestAtItsTwoPoses) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose from = some_pose(random), to = some_pose(random);
    const Course course = from_to(from, to, 2, 0.7);
    for (const double at_s : {2.0, 2.7, 5.0}) {
      const Placement there = placement(course, at_s);
      const Pose& wanted = at_s == 2.0 ? from : to;
      EXPECT_LT(glm::distance(there.X_WO.p, wanted.p), 1e-12);
      EXPECT_LT(turn_rad(there.X_WO, wanted), 1e-7);
      EXPECT_EQ(there.V_WO_W.linear_m_s, glm::dvec3(0));
      EXPECT_EQ(there.V_WO_W.angular_rad_s, glm::dvec3(0));
    }
  }
}

TEST(Course, NeverGoesBackOrBeyond) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 100; ++i) {
    const Pose from = some_pose(random), to = some_pose(random);
    const Course course = from_to(from, to, 0, 1);
    double far_m = 0, turned_rad = 0;
    for (int k = 0; k <= 1000; ++k) {
      const Pose now = placement(course, 1e-3 * k).X_WO;
      ASSERT_GE(glm::distance(now.p, from.p), far_m - 1e-12);
      ASSERT_GE(turn_rad(now, from), turned_rad - 1e-7);
      far_m = glm::distance(now.p, from.p), turned_rad = turn_rad(now, from);
    }
    EXPECT_LE(far_m, glm::distance(to.p, from.p) + 1e-12);
  }
}

TEST(Course, TellsTheVelocityOfItsPose) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 100; ++i) {
    const Course course = from_to(some_pose(random), some_pose(random), 1, 0.5);
    const double at_s = 1 + 0.5 * std::uniform_real_distribution<>(0.01, 0.99)(random), step_s = 1e-6;
    const Placement before = placement(course, at_s - step_s), after = placement(course, at_s + step_s),
                    now = placement(course, at_s);
    const glm::dvec3 v = (after.X_WO.p - before.X_WO.p) / (2 * step_s),
                     w = spatial::vector_from_rotation(after.X_WO.R * glm::conjugate(before.X_WO.R)) / (2 * step_s);
    EXPECT_LT(glm::distance(now.V_WO_W.linear_m_s, v), 1e-6);
    EXPECT_LT(glm::distance(now.V_WO_W.angular_rad_s, w), 1e-6);
  }
}

TEST(Course, OfNumbersThatAreNoneIsNotUsable) {
  const Pose X;
  EXPECT_TRUE(is_usable(at_rest(X, false)));
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(is_usable(from_to(X, X, bad, 1)));
    EXPECT_FALSE(is_usable(from_to(X, X, 0, bad)));
    EXPECT_FALSE(is_usable(from_to({{1, 0, 0, 0}, {bad, 0, 0}}, X, 0, 1)));
  }
  EXPECT_FALSE(is_usable(from_to(X, X, 0, -1)));
  EXPECT_FALSE(is_usable(from_to(X, X, 0, 1e-9)));
  EXPECT_FALSE(is_usable(from_to(X, {{2, 0, 0, 0}, {0, 0, 0}}, 0, 1)));
}

TEST(Course, ThatWasToldTooLateMakesNoJumpAndEndsAtTheSamePlaceAndTime) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 100; ++i) {
    const Course course = from_to(some_pose(random), some_pose(random), 1, 0.5);
    const Placement here{some_pose(random), {}};
    const double now_s = std::uniform_real_distribution<>(1.001, 3)(random);
    const Course late = caught_up(course, here, now_s);
    EXPECT_LT(glm::distance(placement(late, now_s).X_WO.p, here.X_WO.p), 1e-12);
    const double end_s = std::max(1.5, now_s + kCatchUp_s);
    EXPECT_LT(glm::distance(placement(late, end_s + 1e-9).X_WO.p, course.X_to_WO.p), 1e-12);
    EXPECT_TRUE(is_usable(late));
  }
  const Course in_time = from_to({}, some_pose(random), 1, 0.5);
  EXPECT_EQ(caught_up(in_time, {}, 0.9).from_s, 1);
  Course gone = in_time;
  gone.is_there = false;
  EXPECT_EQ(caught_up(gone, {}, 5).from_s, 1) << "what goes is gone at once";
}

/// Two objects that may change, at their first poses.
struct Scene {
  Pose a{{1, 0, 0, 0}, {1, 0, 0}}, b{{1, 0, 0, 0}, {0, 1, 0}};
  MovingObjects objects{{{.object = 4, .before = at_rest(a, true)}, {.object = 7, .before = at_rest(b, false)}}};
  [[nodiscard]] Placement at(std::uint32_t object, double scene_s) const {
    return objects.at(*objects.find(object), scene_s);
  }
};

TEST(CourseOfAnObject, HoldsFromItsTimeOnAndWhatWasBeforeUntilThen) {
  Scene scene;
  const Pose far{{1, 0, 0, 0}, {5, 0, 0}};
  EXPECT_FALSE(scene.objects.set_out({5, from_to(scene.a, far, 2, 1)})) << "no such object";
  EXPECT_TRUE(scene.objects.set_out({4, from_to(scene.a, far, 2, 1)}));
  EXPECT_EQ(scene.at(4, 1.9).X_WO, scene.a);
  EXPECT_DOUBLE_EQ(scene.at(4, 2.5).X_WO.p.x, 3);
  EXPECT_EQ(scene.at(4, 9).X_WO, far);
  EXPECT_FALSE(scene.at(7, 9).is_there);
}

TEST(CourseOfAnObject, AnOlderOneThatComesLateChangesNothing) {
  Scene scene;
  const Pose far{{1, 0, 0, 0}, {5, 0, 0}}, farther{{1, 0, 0, 0}, {9, 0, 0}};
  EXPECT_TRUE(scene.objects.set_out({4, from_to(far, farther, 3, 1, 8)}));
  EXPECT_FALSE(scene.objects.set_out({4, from_to(scene.a, far, 1, 1, 7)}));
  EXPECT_FALSE(scene.objects.set_out({4, from_to(scene.a, far, 1, 1, 8)}));
  EXPECT_EQ(scene.at(4, 2.9).X_WO, scene.a);
  EXPECT_EQ(scene.at(4, 4).X_WO, farther);
}

TEST(CourseOfAnObject, WhatComesAgainElsewhereDragsNothingAlong) {
  Scene scene;
  scene.objects.go_to(0.5);
  Course gone = at_rest(scene.a, false), back = at_rest({{1, 0, 0, 0}, {-3, 2, 1}}, true);
  gone.version = 1, gone.from_s = 1, back.version = 2, back.from_s = 2;
  EXPECT_TRUE(scene.objects.set_out({4, gone}));
  EXPECT_TRUE(scene.objects.set_out({4, back}));
  scene.objects.go_to(1.5);
  EXPECT_FALSE(scene.objects.find(4)->is_there);
  scene.objects.go_to(2.5);
  EXPECT_TRUE(scene.objects.find(4)->is_there);
  EXPECT_EQ(scene.objects.find(4)->way_W, Pose{});
  EXPECT_EQ(scene.objects.X_WO(*scene.objects.find(4)), back.X_to_WO);
}

}  // namespace
}  // namespace farfeel::motion
