// Answers of the device against the simd back end's and the truth's, on random poses and hard cases.
#include <cmath>
#include <numbers>
#include <random>

#include "haptic_core/penetration/reference/reference.h"
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
      EXPECT_NEAR(ours.depth_m, fast.depth_m, fast.doubts & kBorder ? 5e-6 : 0.4e-6) << trial;
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

TEST_F(Egl, HessianAgreesWithTruth) {
  const auto truth = make_reference(kLimits, kTruth);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr double kCurvature_1_per_m = 2600;
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.006, .depth_m = 0.005}, 2e-3, 0.2e-3, 1));
  const auto egl = back_end(crossed, small_tool);
  for (Plates* plates : {&crossed, &small_tool}) {
    for (int trial = 0; trial < kTrials / 2; ++trial) {
      press_at_random(*plates, random, 0.02);
      Query query = plates->query();
      const Penetration ours = evaluate(*egl, query), exact = evaluate(*truth, query);
      if (exact.doubts & kBorder) continue;  // a window that cuts the contact off is no smooth peak
      // A sum of terms like the surfaces' curvatures, which may cancel.
      EXPECT_LT((ours.hessian - exact.hessian).norm(), 0.04 * (exact.hessian.norm() + kCurvature_1_per_m)) << trial;
      EXPECT_EQ(ours.hessian, ours.hessian.transpose());
      query.wants_hessian = false;
      EXPECT_NEAR(evaluate(*egl, query).depth_m, ours.depth_m, 50e-9);
      query.estimates_hessian = true;  // who judges how stiff a contact is gets the same
      EXPECT_LT((evaluate(*egl, query).hessian - ours.hessian).norm(), 1e-3 * ours.hessian.norm()) << trial;
    }
  }
  EXPECT_EQ(egl->tally().by_simd, 0u);
}

/// The highest of many peaks, to rounding, with its derivatives; also where an edge holds it.
TEST_F(Egl, HardMaximaAreSimds) {
  const auto simd = make_simd(kLimits);
  std::mt19937 random(10);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 1.1e-3, 0.2e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), flat_plate({.width_m = 0.005, .depth_m = 0.003}));
  const auto egl = back_end(crossed, small_tool);
  for (Plates* plates : {&crossed, &small_tool}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      press_at_random(*plates, random, 0.05);
      const Penetration ours = evaluate(*egl, plates->query(0)), fast = evaluate(*simd, plates->query(0));
      ASSERT_TRUE(ours.is_known());
      EXPECT_NEAR(ours.depth_m, fast.depth_m, 0.1e-6) << trial;
      if (glm::distance(ours.p_CQ_C, fast.p_CQ_C) > 1e-6) continue;  // of two peaks as high either may be taken
      EXPECT_LT((ours.gradient - fast.gradient).norm(), 1e-3) << trial;
      EXPECT_LT((ours.hessian - fast.hessian).norm(), 1e-3 * fast.hessian.norm() + 1e-3) << trial;
      EXPECT_EQ(ours.doubts & (kSilhouette | kBorder), fast.doubts & (kSilhouette | kBorder)) << trial;
    }
  }
}

/// The source's grid: the same cell as in double precision, or one that is as high.
TEST_F(Egl, RawGridsAreTheReferences) {
  const auto reference = make_reference(kLimits);
  std::mt19937 random(12);
  Plates plates(waves({}, 1.5e-3, 0.3e-3, 0), waves({.width_m = 0.006, .depth_m = 0.005}, 1.1e-3, 0.2e-3, 0.9));
  const auto egl = back_end(plates);
  for (const std::uint32_t n : {1u, 7u, 25u, 47u, 50u, 100u, 200u}) {
    press_at_random(plates, random, 0.05);
    Query query = plates.query(0, n);
    query.refines = false;
    const Penetration ours = evaluate(*egl, query), slow = evaluate(*reference, query);
    ASSERT_EQ(ours.is_known(), slow.is_known()) << n;
    EXPECT_NEAR(ours.depth_m, slow.depth_m, 10e-9) << n;
    if (glm::distance(ours.p_CQ_C, slow.p_CQ_C) > 1e-6) continue;
    EXPECT_LT((ours.gradient - slow.gradient).norm(), 1e-4) << n;
  }
}

/// Windows and grids of any size: the first level is looked at in rounds, and what it keeps may outgrow shared memory.
TEST_F(Egl, GridsOfAnySizeAgree) {
  const auto truth = make_reference(kLimits, kTruth);
  std::mt19937 random(14);
  Plates plates(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.3e-3, 0.9));
  Plates flat(flat_plate({}), flat_plate({.width_m = 0.006, .depth_m = 0.005}));
  const auto egl = back_end(plates, flat);
  for (Plates* pair : {&plates, &flat}) {
    for (const std::uint32_t n : {4u, 25u, 47u, 100u, 400u}) {
      press_at_random(*pair, random, 1e-3);
      Query query = pair->query(kDefaultSoftWidth_m, n);
      query.wants_hessian = false;
      query.window = {{-0.009, -0.009}, {0.009, 0.009}};
      const Penetration ours = evaluate(*egl, query);
      query.samples = 100;
      const Penetration exact = evaluate(*truth, query);
      EXPECT_NEAR(ours.depth_m, exact.depth_m, 0.2e-6) << n;
      EXPECT_LT((ours.gradient - exact.gradient).tail<3>().norm(), 0.01) << n;
    }
  }
}

/// A second layer 8 mm above the touched one: only named triangles count, layers are told, and too deep ones ignored.
TEST_F(Egl, LayersAreTreatedAsInTheReference) {
  const auto reference = make_reference(kLimits);
  const geometry::HapticSurface layer = flat_plate({}), both = support::stacked(layer, layer, {0, 0, 8e-3});
  Plates plates(both, flat_plate({}));
  const auto egl = back_end(plates);
  plates.X_CT.p.z = -0.1e-3;
  const std::vector<std::uint32_t> near{0, 1}, all{0, 1, 2, 3};
  for (const std::vector<std::uint32_t>& s_triangles : {near, all}) {
    for (const double deepest_m : {1e-3, 1.0}) {
      for (const double w : {0.0, kDefaultSoftWidth_m}) {
        Query query = plates.query(w);
        query.s.triangles = s_triangles;
        query.t.triangles = near;
        query.deepest_m = deepest_m;
        const Penetration a = evaluate(*egl, query), b = evaluate(*reference, query);
        ASSERT_EQ(a.is_known(), b.is_known());
        if (!a.is_known()) continue;
        EXPECT_NEAR(a.depth_m, b.depth_m, 0.1e-6);
        EXPECT_EQ(a.doubts & kSeveralLayers, b.doubts & kSeveralLayers);
      }
    }
  }
}

/// Charts that lean up to 35 degrees from the direction: much parallax, and Newton from the coarse facet.
TEST_F(Egl, LeaningChartsAgree) {
  const auto simd = make_simd(kLimits);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates plates(waves({}, 1.5e-3, 0.2e-3, 0.2), waves({}, 2.2e-3, 0.2e-3, 1.1));
  const auto egl = back_end(plates);
  for (int trial = 0; trial < kTrials; ++trial) {
    const double lean = trial % 2 ? 0.6 : 0.3;
    const glm::dquat leaning = spatial::rotation_from_vector({lean, 0.2 * unit(random), 0});
    const glm::dvec3 p{2e-3 * unit(random), 2e-3 * unit(random), 0};
    plates.X_CS = {leaning, {0, 0, 0}};
    plates.X_CT = {
        leaning * spatial::rotation_from_vector({0.02 * unit(random), 0.02 * unit(random), unit(random)}) * kTurnedOver,
        leaning * glm::dvec3{p.x, p.y, 0.05e-3}};
    Query query = plates.query();
    query.wants_hessian = false;
    const Penetration ours = evaluate(*egl, query), fast = evaluate(*simd, query);
    ASSERT_TRUE(ours.is_known() && fast.is_known());
    EXPECT_NEAR(ours.depth_m, fast.depth_m, fast.doubts & kBorder ? 1e-6 : 0.3e-6) << trial;
    EXPECT_LT((ours.gradient - fast.gradient).tail<3>().norm(), 0.03) << trial;
  }
}

/// Two teeth that meet at their corners, steep: most of the weight lies within a few micrometres.
TEST_F(Egl, SteepCornersAgree) {
  const auto simd = make_simd(kLimits);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  Plates plates(flat_plate({.width_m = 0.004, .depth_m = 0.004}), flat_plate({.width_m = 0.004, .depth_m = 0.004}));
  const auto egl = back_end(plates);
  for (int trial = 0; trial < kTrials; ++trial) {
    plates.X_CT.R =
        spatial::rotation_from_vector({0.3 + 0.3 * unit(random), 0.3 + 0.3 * unit(random), 0}) * kTurnedOver;
    plates.X_CT.p = {0.003 + 0.0005 * unit(random), 0.003 + 0.0005 * unit(random), 0.001};
    Query query = plates.query();
    query.window = {{-0.002, -0.002}, {0.003, 0.003}};
    const Penetration ours = evaluate(*egl, query), fast = evaluate(*simd, query);
    ASSERT_TRUE(ours.is_known() && fast.is_known());
    EXPECT_NEAR(ours.depth_m, fast.depth_m, 2e-6) << trial;
    EXPECT_LT((ours.gradient - fast.gradient).tail<3>().norm(), 0.05 * fast.gradient.tail<3>().norm()) << trial;
    EXPECT_EQ(ours.doubts & kSilhouette, kSilhouette);
  }
}

TEST_F(Egl, WhereNothingIsSharedNothingIsKnown) {
  Plates plates(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  const auto egl = back_end(plates);
  Query query = plates.query();
  query.window = {{0.1, 0.1}, {0.2, 0.2}};
  EXPECT_FALSE(evaluate(*egl, query).is_known());
  query = plates.query();
  query.deepest_m = -1;  // all of it belongs to another layer
  EXPECT_FALSE(evaluate(*egl, query).is_known());
  EXPECT_EQ(egl->tally().by_simd, 0u);
}

}  // namespace
}  // namespace farfeel::penetration::egl
