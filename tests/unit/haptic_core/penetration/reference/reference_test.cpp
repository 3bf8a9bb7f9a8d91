#include "haptic_core/penetration/reference/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "haptic_core/penetration/reference/eleven_evaluations.h"
#include "haptic_core/penetration/window.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

using support::flat_plate;
using support::PlateSize;
using support::textured_plate;

double ridges(double x, double period_m, double height_m) {
  return 0.5 * height_m * (std::cos(2 * std::numbers::pi * x / period_m) - 1);
}

geometry::HapticSurface ridged_plate(const PlateSize& size, double period_m, double height_m, double turn_rad = 0) {
  return textured_plate(size, [=](double x, double y) {
    return ridges(std::cos(turn_rad) * x + std::sin(turn_rad) * y, period_m, height_m);
  });
}

geometry::HapticSurface spherical_plate(const PlateSize& size, double radius_m) {
  return textured_plate(size,
                        [=](double x, double y) { return std::sqrt(radius_m * radius_m - x * x - y * y) - radius_m; });
}

#ifdef FARFEEL_SANITIZED
constexpr int kTrials = 1;
#else
constexpr int kTrials = 6;
#endif

std::unique_ptr<BackEnd> reference() {
  return make_reference(Limits{.coarse_triangles = 64});
}

TEST(Reference, PlaneOnPlaneIsTheirOverlapSpreadOverTheWindow) {
  Plates plates(flat_plate({}), flat_plate({}));
  plates.X_CT.p = {0.001, -0.002, -0.2e-3};  // T's face lies 0.2 mm inside S
  const auto back_end = reference();
  const Penetration soft = evaluate(*back_end, plates.query());
  const double area_m2 = 0.008 * 0.008;
  EXPECT_NEAR(soft.depth_m, 0.2e-3 + 10e-6 * std::log(area_m2 / kReferenceArea_m2), 1e-12);
  EXPECT_NEAR(soft.p_CQ_C.x, 0, 1e-9);
  EXPECT_NEAR(soft.gradient[5], -1, 1e-12);
  EXPECT_NEAR(evaluate(*back_end, plates.query(0)).depth_m, 0.2e-3, 1e-12);
}

TEST(Reference, ATiltedPlaneHasTheIntegralOfAnExponential) {
  Plates plates(flat_plate({}), flat_plate({}));
  const double slope = 0.01;
  plates.X_CT.R = spatial::rotation_from_vector({0, -std::atan(slope), 0}) * kTurnedOver;
  plates.X_CT.p = {0, 0, -0.1e-3};
  const double w = 20e-6, half = 0.004;
  const Penetration answer = evaluate(*make_reference({.coarse_triangles = 8}, kTruth), plates.query(w));
  const double area_m2 = 2 * half * (2 * w / slope) * std::sinh(slope * half / w);
  EXPECT_NEAR(answer.depth_m, 0.1e-3 + w * std::log(area_m2 / kReferenceArea_m2),
              1e-8);  // the window cuts it off sharply
}

TEST(Reference, SphereOnPlane) {
  const double radius_m = 0.01;
  Plates plates(flat_plate({}), spherical_plate({.width_m = 0.006, .depth_m = 0.006}, radius_m));
  const auto back_end = reference();
  for (const double depth_m : {0.5e-3, 0.05e-3, -0.3e-3}) {
    plates.X_CT.p = {0.31e-3, -0.17e-3, -depth_m};
    const Penetration hard = evaluate(*back_end, plates.query(0));
    EXPECT_NEAR(hard.depth_m, depth_m, 2e-8);  // 16 bits over 0.9 mm
    EXPECT_NEAR(hard.p_CQ_C.x, 0.31e-3, 5e-6);
    EXPECT_NEAR(hard.gradient[5], -1, 1e-9);
    const double w = 10e-6;
    const Penetration soft = evaluate(*back_end, plates.query(w));
    EXPECT_NEAR(soft.depth_m, depth_m + w * std::log(2 * std::numbers::pi * w * radius_m / kReferenceArea_m2), 5e-8);
    EXPECT_EQ(soft.doubts, 0u);
  }
}

/// Ridged plates, smooth pairs, edges in reach: whatever the pair, the gradient is the derivative of the depth.
TEST(Reference, GradientAndHessianAreDerivatives) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  // Fine enough that a cell which joins or leaves the sum between two differences is not seen.
  const auto back_end = make_reference({.coarse_triangles = 8}, {.tail_widths = 40, .most_nodes = 1'000'000});
  Plates crossed(ridged_plate({}, 1.5e-3, 0.3e-3), ridged_plate({}, 4.2e-3, 0.6e-3, 0.9));
  Plates smooth(ridged_plate({}, 3e-3, 0.5e-3), flat_plate({}));
  Plates small_tool(ridged_plate({}, 3e-3, 0.5e-3, 0.4), flat_plate({.width_m = 0.005, .depth_m = 0.003}));
  Plates small_scene(flat_plate({.width_m = 0.005, .depth_m = 0.003}), ridged_plate({}, 3e-3, 0.5e-3, 0.4));
  for (Plates* plates : {&crossed, &smooth, &small_tool, &small_scene}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      plates->X_CT.R =
          spatial::rotation_from_vector(0.05 * glm::dvec3{unit(random), unit(random), 20 * unit(random)}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.1 * unit(random)};
      const Query query = plates->query();
      const Penetration answer = evaluate(*back_end, query);
      ASSERT_TRUE(answer.is_known());
      const Differences expected = differences(*back_end, *plates, query, 2e-9);
      EXPECT_LT((answer.gradient - expected.gradient).norm(), 2e-6 * answer.gradient.norm()) << trial;
      // How an edge itself turns with T is left out of the second derivative; all else is exact.
      const auto difference = answer.hessian - expected.hessian;
      if (plates == &crossed || plates == &smooth) {
        EXPECT_LT(difference.norm(), 2e-4 * answer.hessian.norm()) << trial;
      }
      EXPECT_LT((difference.bottomRightCorner<3, 3>().norm()), 2e-4 * answer.hessian.norm()) << trial;
    }
  }
}

TEST(Reference, TheHardMaximumsDerivativesComeFromItsPlaceAlone) {
  Plates plates(ridged_plate({}, 1.5e-3, 0.3e-3), ridged_plate({}, 4.2e-3, 0.6e-3, 0.9));
  plates.X_CT.R = spatial::rotation_from_vector({0.002, -0.001, 0.3}) * kTurnedOver;
  plates.X_CT.p = {0.3e-3, 0.2e-3, -0.1e-3};
  const auto back_end = reference();
  const Penetration answer = evaluate(*back_end, plates.query(0));
  EXPECT_EQ(answer.doubts, 0u);
  const Differences expected = differences(*back_end, plates, plates.query(0), 1e-7);
  EXPECT_LT((answer.gradient - expected.gradient).norm(), 1e-5);
  EXPECT_LT((answer.hessian - expected.hessian).norm(), 1e-3 * answer.hessian.norm());
}

TEST(Reference, ADepthIsTheSameFromAnyFrameOfTheSameDirection) {
  Plates plates(ridged_plate({}, 1.5e-3, 0.3e-3), spherical_plate({.width_m = 0.006, .depth_m = 0.006}, 0.01));
  plates.X_CT.p = {0.2e-3, 0.1e-3, -0.2e-3};
  plates.window = {{-0.003, -0.003}, {0.003, 0.003}};
  const auto back_end = reference();
  const Penetration here = evaluate(*back_end, plates.query());
  const spatial::Pose X_DC{spatial::rotation_from_vector({0, 0, 0.7}), {0.4e-3, -0.3e-3, 0.02}};
  plates.X_CS = X_DC * plates.X_CS;
  plates.X_CT = X_DC * plates.X_CT;
  plates.window = {{-0.004, -0.004}, {0.004, 0.004}};
  const Penetration there = evaluate(*back_end, plates.query());
  EXPECT_NEAR(there.depth_m, here.depth_m, 1e-8);  // the two grids fall differently on 16-bit heights
  EXPECT_LT(glm::length(there.p_CQ_C - spatial::transform_point(X_DC, here.p_CQ_C)), 1e-7);
  const spatial::Wrench turned{spatial::rotate(X_DC, spatial::wrench_from(here.gradient).torque_Nm),
                               spatial::rotate(X_DC, spatial::wrench_from(here.gradient).force_N)};
  EXPECT_LT((there.gradient - spatial::to_vector6(turned)).norm(), 1e-4);
}

TEST(Reference, OnlyTheNamedTrianglesTakePart) {
  const geometry::HapticSurface near_layer = flat_plate({}),
                                all = support::stacked(near_layer, near_layer, {0, 0, 8e-3});
  Plates plates(all, flat_plate({}));
  plates.X_CT.p.z = -0.1e-3;
  const auto back_end = reference();
  EXPECT_NEAR(evaluate(*back_end, plates.query(0)).depth_m, 0.1e-3, 1e-9);
  plates.all = {0, 1, 2, 3};
  Query both = plates.query(0);
  const std::vector<std::uint32_t> tool{0, 1};
  both.t.triangles = tool;
  EXPECT_NE(evaluate(*back_end, both).doubts & kSeveralLayers, 0u);
}

TEST(Reference, FlatOnFlatKeepsItsTorqueSteady) {
  Plates plates(flat_plate({}), flat_plate({.width_m = 0.006, .depth_m = 0.006}));
  const auto back_end = reference();
  for (const double tilt : {0.0, 1e-9, 1e-7, 1e-5}) {
    plates.X_CT.R = spatial::rotation_from_vector({tilt, 0.3 * tilt, 0}) * kTurnedOver;
    plates.X_CT.p.z = -0.2e-3;
    const Penetration answer = evaluate(*back_end, plates.query());
    EXPECT_LT(glm::length(glm::dvec2{answer.p_CQ_C}), 0.05e-3) << tilt;
  }
}

TEST(Reference, ASurfaceThatStandsSteeplyIsNoHeightField) {
  Plates plates(flat_plate({}), flat_plate({}));
  const double tilt = 75 * std::numbers::pi / 180;
  plates.X_CS.R = spatial::rotation_from_vector({tilt, 0, 0});
  plates.X_CT.R = spatial::rotation_from_vector({tilt, 0, 0}) * kTurnedOver;
  EXPECT_FALSE(evaluate(*reference(), plates.query()).is_known());
}

TEST(Reference, ElevenEvaluationsAgreeAsFarAsDifferencesCan) {
  Plates plates(ridged_plate({}, 3e-3, 0.3e-3), ridged_plate({}, 4.2e-3, 0.3e-3, 0.9));
  plates.X_CT.R = spatial::rotation_from_vector({0.004, -0.003, 0.3}) * kTurnedOver;
  plates.X_CT.p = {0.3e-3, 0.2e-3, -0.1e-3};
  const auto back_end = reference();
  for (const double soft_width_m : {0.0, 10e-6}) {
    const Query query = plates.query(soft_width_m);
    const Penetration analytic = evaluate(*back_end, query);
    // The spline's second derivative jumps at texels, so central differences err in proportion to the step.
    for (const double step : {8e-6, 4e-6, 2e-6}) {
      const Penetration differences = eleven_evaluations(*back_end, query, {step, step / 0.01});
      EXPECT_EQ(differences.depth_m, analytic.depth_m);
      EXPECT_LT((differences.gradient - analytic.gradient).norm(), 300 * step) << soft_width_m;
    }
    // On the raw grid, as the source had it, the place of the best cell alone decides: coarse, but the same contact.
    Query raw = plates.query(0);
    raw.refines = false;
    const Penetration historical = eleven_evaluations(*back_end, raw, {});
    EXPECT_NEAR(historical.depth_m, evaluate(*back_end, plates.query(0)).depth_m, 10e-6);
    EXPECT_LT((historical.gradient - analytic.gradient).tail<3>().norm(), 0.3);
  }
}

TEST(Reference, TwoEqualPeaksShareTheContactSmoothly) {
  // Crests at x = +-1.5 mm of S under a flat tool that tilts from one to the other.
  Plates plates(ridged_plate({}, 3e-3, 0.3e-3, 0), flat_plate({}));
  plates.X_CS.p.x = 1.5e-3;
  plates.window = {{-0.0029, -0.002}, {0.0029, 0.002}};
  const auto back_end = reference();
  double last_x = -1.5e-3;
  for (int i = -40; i <= 40; ++i) {
    plates.X_CT.R = spatial::rotation_from_vector({0, 0.02 * i / 40.0, 0}) * kTurnedOver;
    const Penetration answer = evaluate(*back_end, plates.query(20e-6));
    EXPECT_LT(std::abs(answer.p_CQ_C.x - last_x), 0.15e-3) << i;  // the hard maximum jumps by 3 mm
    last_x = answer.p_CQ_C.x;
  }
  EXPECT_GT(last_x, 0.9e-3);
}

TEST(WindowFinder, FindsTheContactAndNothingElse) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates plates(ridged_plate({.width_m = 0.03, .depth_m = 0.03}, 1.5e-3, 0.3e-3),
                ridged_plate({.width_m = 0.006, .depth_m = 0.005}, 4.2e-3, 0.6e-3, 0.9));
  WindowFinder finder({.coarse_triangles = 8});
  const auto back_end = reference();
  for (int trial = 0; trial < 3 * kTrials; ++trial) {
    plates.X_CT.R =
        spatial::rotation_from_vector({0.1 * unit(random), 0.1 * unit(random), 3 * unit(random)}) * kTurnedOver;
    plates.X_CT.p = {0.001 * unit(random), 0.001 * unit(random), 0};
    Query query = plates.query(kDefaultSoftWidth_m, 100);
    const auto window = finder.fit(query.s, query.t, kWholePlane, 200e-6, query.deepest_m);
    ASSERT_TRUE(window);
    EXPECT_LT(window->high.x - window->low.x, 0.0085);  // never more than the smaller plate's diagonal
    query.window = {{-0.0055, -0.0055}, {0.0055, 0.0055}};
    const Penetration whole = evaluate(*back_end, query);
    query.window = *window;
    const Penetration fitted = evaluate(*back_end, query);
    EXPECT_NEAR(fitted.depth_m, whole.depth_m, 5e-7) << trial;
    EXPECT_LT((fitted.gradient - whole.gradient).tail<3>().norm(), 0.05) << trial;
  }
  Query apart = plates.query();
  apart.t.X_CO.p.x = 0.05;
  EXPECT_FALSE(finder.fit(apart.s, apart.t, kWholePlane, 200e-6, apart.deepest_m));
}

TEST(Reference, PatchesThatDoNotMeetSaySo) {
  Plates plates(flat_plate({.width_m = 0.002}), flat_plate({.width_m = 0.002}));
  plates.X_CT.p.x = 0.0035;
  const Penetration answer = evaluate(*reference(), plates.query());
  EXPECT_FALSE(answer.is_known());
  EXPECT_TRUE(std::isnan(answer.depth_m));
}

}  // namespace
}  // namespace farfeel::penetration
