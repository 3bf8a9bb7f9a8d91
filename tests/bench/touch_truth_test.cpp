// The judge against shapes whose depths can be written down, and against every triangle in turn.
#include "tests/bench/touch_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/bench/touch_models.h"
#include "tests/bench/touch_side.h"
#include "tests/bench/touch_solids.h"

namespace farfeel::bench {
namespace {

using geometry::TriangleMesh;

constexpr double kmm = 1e-3, kExact_m = 1e-9;
constexpr RoundTool kBall{3 * kmm, 0};

TriangleMesh box(const glm::dvec3& half_m) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions_O.push_back(half_m * glm::dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

RoundToolPose from_above(double x_m, double y_m, double touching_z_m, double pressed_m) {
  return {{x_m, y_m, touching_z_m - pressed_m}, {0, 0, 1}, {0, 0, 1}, std::max(0.0, pressed_m)};
}

void expect_way(const WayOut& way, double depth_m, const glm::dvec3& out, double tolerance_m) {
  EXPECT_NEAR(way.depth_m, depth_m, tolerance_m);
  EXPECT_GT(glm::dot(way.out_O, out), 1 - 1e-3);
}

TEST(TouchTruth, SolidsAreClosedAndFaceOutwards) {
  for (const TouchModel& model : touch_models("nowhere")) {
    const auto mesh = touch_mesh(model);
    if (!model.scan.empty()) {
      EXPECT_FALSE(mesh.has_value());
      continue;
    }
    ASSERT_TRUE(mesh.has_value()) << model.name;
    EXPECT_TRUE(geometry::is_closed_and_oriented(mesh->mesh)) << model.name;
    EXPECT_GT(geometry::signed_volume_m3(mesh->mesh), 0) << model.name;
  }
  EXPECT_TRUE(geometry::is_closed_and_oriented(capsule_mesh(1, 40)));
}

TEST(TouchTruth, BallOnAPlane) {
  const TriangleMesh mesh = box({0.02, 0.02, 0.01});
  const TouchTruth truth(mesh);
  for (const double pressed_m : {-2 * kmm, -0.01 * kmm, 0.01 * kmm, 1 * kmm, 2.9 * kmm}) {
    const TrueTouch touch = truth.touch(kBall, from_above(1 * kmm, -2 * kmm, 0.013, pressed_m));
    expect_way(touch.main, pressed_m, {0, 0, 1}, kExact_m);
    EXPECT_FALSE(touch.is_past_middle || touch.is_squeezed || touch.aside);
  }
}

TEST(TouchTruth, BallWhoseMiddleIsInTheMaterialIsAsDeepAsItCame) {
  const TriangleMesh mesh = box({0.02, 0.02, 0.01});
  const TouchTruth truth(mesh);
  for (const double pressed_m : {3.5 * kmm, 8 * kmm, 20 * kmm, 25 * kmm}) {
    const TrueTouch touch = truth.touch(kBall, from_above(1 * kmm, -2 * kmm, 0.013, pressed_m));
    expect_way(touch.main, pressed_m, {0, 0, 1}, kExact_m);
    EXPECT_EQ(touch.is_past_middle, pressed_m > 13 * kmm) << pressed_m;  // 10 mm below the face
  }
}

TEST(TouchTruth, ANearSideIsAWayOutToo) {
  const TriangleMesh mesh = box({0.001, 0.02, 0.01});  // a fin of 2 mm
  const TouchTruth truth(mesh);
  const TrueTouch touch = truth.touch({0.25 * kmm, 0}, from_above(0.4 * kmm, 0, 0.01025, 3 * kmm));
  expect_way(touch.main, 3 * kmm, {0, 0, 1}, kExact_m);
  ASSERT_TRUE(touch.aside.has_value());
  expect_way(*touch.aside, 0.85 * kmm, {1, 0, 0}, kExact_m);
  EXPECT_NEAR(touch.depth_nearest_m(0.9 * kmm), 0.85 * kmm, kExact_m);
  EXPECT_NEAR(touch.angle_rad({1, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(touch.angle_rad({0, 0, 1}), 0, 1e-6);
  EXPECT_GT(touch.angle_rad({-0.8, 0, -0.6}), 2);
}

TEST(TouchTruth, BallOnABall) {
  const TriangleMesh mesh = ball_mesh(60);
  const TouchTruth truth(mesh);
  constexpr double kSag_m = 10e-6;
  const glm::dvec3 out = glm::normalize(glm::dvec3(1, 2, -0.5));
  for (const double pressed_m : {-1 * kmm, 0.3 * kmm, 5 * kmm}) {
    const RoundToolPose pose{(0.033 - pressed_m) * out, {0, 0, 1}, out, std::max(0.0, pressed_m)};
    expect_way(truth.touch(kBall, pose).main, pressed_m, out, kSag_m);
  }
}

TEST(TouchTruth, BowlFromBothSidesAndThroughItsWall) {
  const TriangleMesh mesh = bowl_mesh(3);
  const TouchTruth truth(mesh);
  constexpr double kFacets_m = 70e-6;  // 96 sides and steps of 2 mm on a radius of 60 mm
  const glm::dvec3 outward = glm::normalize(glm::dvec3(0.3, -0.5, -0.8));
  for (const double pressed_m : {-0.5 * kmm, 0.3 * kmm, 1 * kmm, 4 * kmm, 7 * kmm}) {
    const RoundToolPose outside{(0.063 - pressed_m) * outward, {0, 0, 1}, outward, std::max(0.0, pressed_m)};
    const RoundToolPose inside{(0.054 + pressed_m) * outward, {0, 0, 1}, -outward, std::max(0.0, pressed_m)};
    const TrueTouch from_outside = truth.touch(kBall, outside), from_inside = truth.touch(kBall, inside);
    EXPECT_NEAR(from_outside.main.depth_m, pressed_m, kFacets_m);
    EXPECT_NEAR(from_inside.main.depth_m, pressed_m, kFacets_m);
    EXPECT_GT(glm::dot(from_outside.main.out_O, outward), 0.99);
    EXPECT_LT(glm::dot(from_inside.main.out_O, outward), -0.99);
    EXPECT_EQ(from_outside.is_past_middle, pressed_m > 5 * kmm);
  }
}

TEST(TouchTruth, BallInASlotIsSqueezed) {
  const TriangleMesh mesh = fins_mesh(1.5);  // gaps of 4.5 mm, the first from x = 1.5 mm on, y from -20 mm
  const TouchTruth truth(mesh);
  const RoundToolPose pose{{3.75 * kmm, 0, 15 * kmm}, {0, 0, 1}, {0, 0, 1}, 10 * kmm};
  const TrueTouch touch = truth.touch(kBall, pose);
  EXPECT_NEAR(touch.main.depth_m, 0.75 * kmm, kExact_m);
  EXPECT_TRUE(touch.is_squeezed);
}

TEST(TouchTruth, CapsuleOnAPlane) {
  const TriangleMesh mesh = box({0.1, 0.1, 0.01});
  const TouchTruth truth(mesh);
  const RoundTool needle{0.5 * kmm, 19.5 * kmm};
  for (const double tilt : {0.0, 0.4, 1.2, -0.7, 1.5}) {
    const glm::dvec3 axis{std::sin(tilt), 0, std::cos(tilt)};
    for (const double pressed_m : {-1 * kmm, 0.3 * kmm, 2 * kmm}) {
      const double z = 0.01 + 0.5 * kmm + 19.5 * kmm * std::cos(tilt) - pressed_m;
      const RoundToolPose pose{{0, 0, z}, axis, {0, 0, 1}, std::max(0.0, pressed_m)};
      expect_way(truth.touch(needle, pose).main, pressed_m, {0, 0, 1}, 3e-6);
    }
  }
}

TEST(TouchTruth, NearestAsOfAllTriangles) {
  const TriangleMesh mesh = knurl_mesh(4);
  const TouchTruth truth(mesh);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 40; ++i) {
    const glm::dvec3 p{0.02 * unit(random), 0.02 * unit(random), 0.02 + 0.03 * unit(random)};
    // Points of every triangle, sampled: no one may be nearer, and the nearest must be near the sampled one.
    double least_m = std::numeric_limits<double>::infinity(), longest_edge_m = 0;
    for (const geometry::Triangle& t : mesh.triangles) {
      const glm::dvec3 &a = mesh.positions_O[t[0]], &b = mesh.positions_O[t[1]], &c = mesh.positions_O[t[2]];
      for (const glm::dvec3& q : {a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0}) {
        const double d = glm::length(p - q);
        if (d < least_m) {
          least_m = d;
          longest_edge_m = std::max({glm::length(a - b), glm::length(b - c), glm::length(c - a)});
        }
      }
    }
    const TouchTruth::Nearest found = truth.nearest(p);
    EXPECT_LE(found.distance_m, least_m + kExact_m);
    EXPECT_GE(found.distance_m, least_m - longest_edge_m);
    EXPECT_NEAR(glm::length(p - found.q_O), found.distance_m, kExact_m);
  }
}

TEST(TouchTruth, SideIsKnownAlongAnyPath) {
  const TriangleMesh mesh = box({0.05, 0.05, 0.001});  // a wall of 2 mm
  const TouchTruth truth(mesh);
  SideWatch side(truth, {0, 0, 0.01});
  const auto at = [&](double x_m, double z_m) { return side.move_to({x_m, 0, z_m}, 3 * kmm).main; };
  expect_way(at(0, 0.005), -1 * kmm, {0, 0, 1}, kExact_m);
  expect_way(at(0, 0.0005), 3.5 * kmm, {0, 0, 1}, kExact_m);  // in the wall
  EXPECT_TRUE(side.is_behind());
  expect_way(at(0.01, -0.006), 10 * kmm, {0, 0, 1}, kExact_m);  // right through, and aside
  EXPECT_TRUE(side.is_behind());
  expect_way(at(0.01, 0.002), 2 * kmm, {0, 0, 1}, kExact_m);  // and back in one step
  EXPECT_FALSE(side.is_behind());
  expect_way(at(0.01, -0.0015), 5.5 * kmm, {0, 0, 1}, kExact_m);  // through both faces in one step
  EXPECT_TRUE(side.is_behind());
}

TEST(TouchTruth, RoundTheRimIsNotThrough) {
  const TriangleMesh mesh = box({0.05, 0.05, 0.001});
  const TouchTruth truth(mesh);
  SideWatch side(truth, {0.04, 0, 0.01});
  for (int i = 0; i <= 100; ++i) {
    const double angle = 3.1 * i / 100;
    (void)side.move_to({0.04 + 0.02 * std::sin(angle), 0, 0.01 * std::cos(angle)}, 3 * kmm);
    EXPECT_FALSE(side.is_behind());
  }
  expect_way(side.move_to({0, 0, -0.002}, 3 * kmm).main, 2 * kmm, {0, 0, -1}, kExact_m);
}

TEST(TouchTruth, LeavingAFinByItsSideIsNotThrough) {
  const TriangleMesh mesh = box({0.001, 0.02, 0.01});
  const TouchTruth truth(mesh);
  SideWatch side(truth, {0.0004, 0, 0.02});
  const TrueTouch inside = side.move_to({0.0004, 0, 0.008}, 3 * kmm);
  EXPECT_TRUE(side.is_behind());
  expect_way(inside.main, 5 * kmm, {0, 0, 1}, kExact_m);
  ASSERT_TRUE(inside.aside.has_value());
  EXPECT_NEAR(pushed_back_share(inside, {3.6, 0, 0}, 1000, 12), 1, 1e-6);  // 3.6 mm to the side at 1 N/mm
  EXPECT_NEAR(pushed_back_share(inside, {0, 0, 2.5}, 1000, 12), 0.5, 1e-6);
  (void)side.move_to({0.003, 0, 0.008}, 3 * kmm);
  EXPECT_FALSE(side.is_behind());
}

}  // namespace
}  // namespace farfeel::bench
