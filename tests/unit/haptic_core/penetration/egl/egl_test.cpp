// Answers of the device against the simd back end's and the truth's, on random poses and hard cases.
#include <cmath>
#include <numbers>
#include <random>

#include "haptic_core/penetration/window.h"
#include "tests/unit/haptic_core/penetration/egl/device_fixture.h"

namespace farfeel::penetration::egl {
namespace {

using support::flat_plate;

#ifdef FARFEEL_SANITIZED
constexpr int kTrials = 2;  // truth is slow, and slower still when every access is checked
#else
constexpr int kTrials = 12;
#endif

class Egl : public OnDevice {};

TEST_F(Egl, DepthAndGradientAgreeWithSimdAndTruth) {
  const auto simd = make_simd(kLimits);
  const auto truth = make_reference(kLimits, {.steps_per_width = 2, .tail_widths = 20, .most_nodes = 2'000'000});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.006, .depth_m = 0.005}, 2e-3, 0.2e-3, 1));
  Plates flat_tool(waves({}, 1.5e-3, 0.3e-3, 0), flat_plate({.width_m = 0.006, .depth_m = 0.005}));
  Plates flat_scene(flat_plate({}), waves({}, 1.5e-3, 0.3e-3, 0.2));
  Plates flat(flat_plate({}), flat_plate({.width_m = 0.006, .depth_m = 0.005}));
  const auto egl = back_end(crossed, small_tool, flat_tool, flat_scene, flat);
  WindowFinder finder(kLimits);
  double worst_depth_m = 0, worst_gradient = 0, worst_truth_m = 0;
  for (Plates* plates : {&crossed, &small_tool, &flat_tool, &flat_scene, &flat}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const double tilt = trial % 2 ? 0.02 : 0.1;
      plates->X_CT.R =
          spatial::rotation_from_vector({tilt * unit(random), tilt * unit(random), 3 * unit(random)}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      Query query = plates->query(kDefaultSoftWidth_m, trial % 3 ? 50 : 47);
      query.wants_hessian = false;
      query.window = *finder.fit(query.s, query.t, {{-0.005, -0.005}, {0.005, 0.005}}, 200e-6, query.deepest_m);
      const Penetration ours = evaluate(*egl, query), fast = evaluate(*simd, query), exact = evaluate(*truth, query);
      ASSERT_TRUE(ours.is_known());
      worst_depth_m = std::max(worst_depth_m, std::abs(ours.depth_m - fast.depth_m));
      worst_truth_m = std::max(worst_truth_m, std::abs(ours.depth_m - exact.depth_m));
      worst_gradient = std::max(worst_gradient, (ours.gradient - fast.gradient).tail<3>().norm());
      // A window that cuts the contact off makes a peak that no surface has.
      const double tolerance_m = exact.doubts & kBorder ? 1e-6 : 0.2e-6;
      EXPECT_NEAR(ours.depth_m, fast.depth_m, tolerance_m) << trial;
      EXPECT_NEAR(ours.depth_m, exact.depth_m, tolerance_m) << trial;
      EXPECT_LT((ours.gradient - exact.gradient).tail<3>().norm(), 0.025) << trial;
      EXPECT_LT((ours.gradient - exact.gradient).head<3>().norm(), 0.025 * 0.005) << trial;
      EXPECT_LT(glm::distance(ours.p_CQ_C, exact.p_CQ_C), 0.1e-3) << trial;
    }
  }
  EXPECT_EQ(egl->tally().by_simd, 0u);
  RecordProperty("worst_depth_um", std::to_string(1e6 * worst_depth_m));
  RecordProperty("worst_gradient", std::to_string(worst_gradient));
}

}  // namespace
}  // namespace farfeel::penetration::egl
