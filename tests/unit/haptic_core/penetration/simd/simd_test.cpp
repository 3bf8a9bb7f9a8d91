#include "haptic_core/penetration/simd/simd.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <cmath>
#include <cstdio>
#include <random>

#include "haptic_core/penetration/window.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

using support::flat_plate;

#ifdef FARFEEL_SANITIZED
constexpr int kTrials = 2;  // truth is slow, and slower still when every access is checked
#else
constexpr int kTrials = 12;
#endif

class SimdAgainstTruth : public testing::TestWithParam<InstructionSet> {};

TEST_P(SimdAgainstTruth, DepthAndGradientAgree) {
  const auto simd = make_simd({.coarse_triangles = 8}, GetParam());
  const auto truth =
      make_reference({.coarse_triangles = 8}, {.steps_per_width = 2, .tail_widths = 20, .most_nodes = 2'000'000});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.006, .depth_m = 0.005}, 2e-3, 0.2e-3, 1));
  Plates flat_tool(waves({}, 1.5e-3, 0.3e-3, 0), flat_plate({.width_m = 0.006, .depth_m = 0.005}));
  Plates flat_scene(flat_plate({}), waves({}, 1.5e-3, 0.3e-3, 0.2));
  Plates flat(flat_plate({}), flat_plate({.width_m = 0.006, .depth_m = 0.005}));
  WindowFinder finder({.coarse_triangles = 8});
  double worst_depth_m = 0, worst_gradient = 0;
  for (Plates* plates : {&crossed, &small_tool, &flat_tool, &flat_scene, &flat}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const double tilt = trial % 2 ? 0.02 : 0.1;
      plates->X_CT.R =
          spatial::rotation_from_vector({tilt * unit(random), tilt * unit(random), 3 * unit(random)}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      Query query = plates->query(kDefaultSoftWidth_m, trial % 3 ? 50 : 47);  // 47: no multiple of any width
      query.wants_hessian = false;
      query.window = *finder.fit(query.s, query.t, {{-0.005, -0.005}, {0.005, 0.005}}, 200e-6, query.deepest_m);
      const Penetration fast = evaluate(*simd, query), exact = evaluate(*truth, query);
      ASSERT_TRUE(fast.is_known());
      worst_depth_m = std::max(worst_depth_m, std::abs(fast.depth_m - exact.depth_m));
      worst_gradient = std::max(worst_gradient, (fast.gradient - exact.gradient).tail<3>().norm());
      // A window that cuts the contact off makes a peak that no surface has.
      EXPECT_NEAR(fast.depth_m, exact.depth_m, exact.doubts & kBorder ? 3e-6 : 0.3e-6) << trial;
      EXPECT_LT((fast.gradient - exact.gradient).tail<3>().norm(), 0.03) << trial;
      EXPECT_LT((fast.gradient - exact.gradient).head<3>().norm(), 0.025 * 0.005) << trial;
    }
  }
  RecordProperty("worst_depth_um", std::to_string(1e6 * worst_depth_m));
  RecordProperty("worst_gradient", std::to_string(worst_gradient));
}

/// Curvature, and that asking for it changes nothing else.
TEST_P(SimdAgainstTruth, HessianAgrees) {
  const auto simd = make_simd({.coarse_triangles = 8}, GetParam());
  const auto truth = make_reference({.coarse_triangles = 8}, kTruth);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr double kCurvature_1_per_m = 2600;
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.006, .depth_m = 0.005}, 2e-3, 0.2e-3, 1));
  for (Plates* plates : {&crossed, &small_tool}) {
    for (int trial = 0; trial < kTrials / 2; ++trial) {
      plates->X_CT.R =
          spatial::rotation_from_vector({0.02 * unit(random), 0.02 * unit(random), 3 * unit(random)}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      Query query = plates->query();
      const Penetration fast = evaluate(*simd, query), exact = evaluate(*truth, query);
      // A sum of terms like the surfaces' curvatures, which may cancel.
      EXPECT_LT((fast.hessian - exact.hessian).norm(), 0.02 * (exact.hessian.norm() + kCurvature_1_per_m)) << trial;
      EXPECT_EQ(fast.hessian, fast.hessian.transpose());
      query.wants_hessian = false;
      EXPECT_NEAR(evaluate(*simd, query).depth_m, fast.depth_m, 0.4e-6);
    }
  }
}

/// What judges how stiff a contact is: the largest eigenvalue of g g^T + depth H, with rotations at an arm of 10 mm.
double largest_of(const Penetration& answer, double depth_m) {
  const spatial::Vector6 arms = (spatial::Vector6() << 0.01, 0.01, 0.01, 1, 1, 1).finished().cwiseInverse();
  const spatial::Matrix6 whole = arms.asDiagonal() *
                                 (answer.gradient * answer.gradient.transpose() + depth_m * answer.hessian) *
                                 arms.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<spatial::Matrix6>(whole, Eigen::EigenvaluesOnly).eigenvalues()[5];
}

/// The estimate costs no finer cells, and is within a fifth: on crossed ridges, in two peaks at once, near silhouettes.
TEST_P(SimdAgainstTruth, TheEstimatedHessianTellsHowStiffAContactIs) {
  const auto fresh = [] { return make_simd({.coarse_triangles = 8}, GetParam()); };  // what it remembers moves nodes
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  Plates meshed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 1.5e-3, 0.3e-3, 0));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.006, .depth_m = 0.005}, 2e-3, 0.2e-3, 1));
  double least = 1e9, most = 0, spread = 0;
  int count = 0;
  for (Plates* plates : {&crossed, &meshed, &small_tool}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const double turn = plates == &meshed ? 1e-3 * unit(random) : 3 * unit(random);
      plates->X_CT.R = spatial::rotation_from_vector({0.02 * unit(random), 0.02 * unit(random), turn}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      Query query = plates->query();
      const Penetration exact = evaluate(*fresh(), query);
      query.wants_hessian = false;
      const Penetration without = evaluate(*fresh(), query);
      query.estimates_hessian = true;
      const Penetration fast = evaluate(*fresh(), query);
      EXPECT_EQ(fast.depth_m, without.depth_m) << "asking for it changes nothing else";
      for (const double depth_m : {0.2e-3, 1e-3}) {
        const double ratio = largest_of(fast, depth_m) / largest_of(exact, depth_m);
        least = std::min(least, ratio), most = std::max(most, ratio);
        spread += std::abs(ratio - 1), ++count;
      }
    }
  }
  std::printf("estimated over exact: %.3f to %.3f, %.3f off on the mean\n", least, most, spread / count);
  EXPECT_GT(least, 0.8);
  EXPECT_LT(most, 1.25);
}

/// The highest of many peaks, to rounding, with its derivatives; also where an edge holds it.
TEST(Simd, HardMaximaAreTheHighestPeak) {
  const auto simd = make_simd({.coarse_triangles = 8});
  const auto dense = make_reference({.coarse_triangles = 8});
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 1.1e-3, 0.2e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), flat_plate({.width_m = 0.005, .depth_m = 0.003}));
  for (Plates* plates : {&crossed, &small_tool}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      plates->X_CT.R =
          spatial::rotation_from_vector({0.05 * unit(random), 0.05 * unit(random), 3 * unit(random)}) * kTurnedOver;
      plates->X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      const Penetration fast = evaluate(*simd, plates->query(0)), slow = evaluate(*dense, plates->query(0, 200));
      ASSERT_TRUE(fast.is_known());
      EXPECT_GT(fast.depth_m, slow.depth_m - 60e-9) << trial;
      EXPECT_LT(fast.depth_m, slow.depth_m + 0.5e-6) << trial;
      if (glm::distance(fast.p_CQ_C, slow.p_CQ_C) > 1e-6) continue;  // of two peaks as high either may be taken
      EXPECT_LT((fast.gradient - slow.gradient).norm(), 1e-3) << trial;
      EXPECT_LT((fast.hessian - slow.hessian).norm(), 1e-3 * slow.hessian.norm() + 1e-3) << trial;
      EXPECT_EQ(fast.doubts & (kSilhouette | kBorder), slow.doubts & (kSilhouette | kBorder)) << trial;
    }
  }
}

/// What it remembers of the last answer decides where the search begins and where the nodes are: also after a leap its
/// answer is a fresh one's, within the quadrature's error, and more where the window cuts the contact off.
TEST(Simd, WhatItRemembersHardlyMatters) {
  const auto remembers = make_simd({.coarse_triangles = 8});
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates plates(waves({}, 3.7e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  for (int trial = 0; trial < 20 * kTrials; ++trial) {
    if (trial % 5 == 0) {
      plates.X_CT.R =
          spatial::rotation_from_vector({0.05 * unit(random), 0.05 * unit(random), 3 * unit(random)}) * kTurnedOver;
    }
    plates.X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
    Query query = plates.query();
    query.wants_hessian = false;
    const Penetration a = evaluate(*remembers, query), b = evaluate(*make_simd({.coarse_triangles = 8}), query);
    EXPECT_NEAR(a.depth_m, b.depth_m, a.doubts & kBorder ? 20e-6 : 0.3e-6) << trial;
    EXPECT_LT((a.gradient - b.gradient).tail<3>().norm(), a.doubts & kBorder ? 0.15 : 0.02) << trial;
  }
}

/// While little moves, what the last search kept is summed again: T slides, turns and tilts, and C turns about both.
TEST(Simd, WhatIsSummedAgainIsAsGoodAsASearch) {
  const auto remembers = make_simd({.coarse_triangles = 8});
  std::mt19937 random(13);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 1.1e-3, 0.2e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.005, .depth_m = 0.003}, 2e-3, 0.2e-3, 1));
  Plates flat_tool(waves({}, 1.5e-3, 0.1e-3, 0), flat_plate({.width_m = 0.005, .depth_m = 0.003}));
  Plates flat(flat_plate({}), flat_plate({.width_m = 0.005, .depth_m = 0.003}));
  std::vector<double> errors;
  double worst_depth_m = 0;
  for (Plates* plates : {&crossed, &small_tool, &flat_tool, &flat}) {
    for (const double speed : {0.2, 1.0, 4.0}) {
      const auto turn = [&](double rad) {
        return spatial::rotation_from_vector({rad * unit(random), rad * unit(random), rad * unit(random)});
      };
      plates->X_CS = {};
      plates->X_CT = {turn(5e-3) * kTurnedOver, 1e-3 * glm::dvec3{unit(random), unit(random), 0}};
      const glm::dvec3 slide = 10e-6 * speed * glm::dvec3{unit(random), unit(random), 0.1 * unit(random)};
      for (int step = 0; step < 5 * kTrials; ++step) {
        const glm::dquat of_T = turn(5e-5 * speed), of_C = turn(5e-5 * speed);
        plates->X_CT = {glm::normalize(of_C * of_T * plates->X_CT.R), of_C * (plates->X_CT.p + slide)};
        plates->X_CS = {glm::normalize(of_C * plates->X_CS.R), of_C * plates->X_CS.p};
        Query query = plates->query();
        query.wants_hessian = false;
        const Penetration a = evaluate(*remembers, query), b = evaluate(*make_simd({.coarse_triangles = 8}), query);
        ASSERT_TRUE(a.is_known() && b.is_known());
        if ((a.doubts | b.doubts) & kBorder) continue;
        worst_depth_m = std::max(worst_depth_m, std::abs(a.depth_m - b.depth_m));
        errors.push_back((a.gradient - b.gradient).tail<3>().norm());
        EXPECT_NEAR(a.depth_m, b.depth_m, 0.3e-6) << step;
        EXPECT_LT(errors.back(), 0.02) << step;
        EXPECT_LT((a.gradient - b.gradient).head<3>().norm(), 0.02 * 0.005) << step;
      }
    }
  }
  std::sort(errors.begin(), errors.end());
  RecordProperty("median", std::to_string(errors[errors.size() / 2]));
  RecordProperty("worst_depth_um", std::to_string(1e6 * worst_depth_m));
  EXPECT_LT(errors[errors.size() / 2], 2e-3);
}

/// The same of hard maxima: none that is left out has become the highest.
TEST(Simd, HardMaximaAreFoundAmongWhatWasKept) {
  const auto remembers = make_simd({.coarse_triangles = 8});
  std::mt19937 random(14);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 1.1e-3, 0.2e-3, 0.9));
  Plates small_tool(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.005, .depth_m = 0.003}, 2e-3, 0.2e-3, 1));
  for (Plates* plates : {&crossed, &small_tool}) {
    for (int path = 0; path < kTrials; ++path) {
      plates->X_CT = {
          spatial::rotation_from_vector({0.02 * unit(random), 0.02 * unit(random), 3 * unit(random)}) * kTurnedOver,
          1e-3 * glm::dvec3{unit(random), unit(random), 0}};
      const glm::dvec3 slide = 8e-6 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      const glm::dquat turn =
          spatial::rotation_from_vector(1e-4 * glm::dvec3{unit(random), unit(random), unit(random)});
      for (int step = 0; step < 40; ++step) {
        plates->X_CT = {glm::normalize(turn * plates->X_CT.R), plates->X_CT.p + slide};
        const Query query = plates->query(0);
        const Penetration a = evaluate(*remembers, query), b = evaluate(*make_simd({.coarse_triangles = 8}), query);
        ASSERT_TRUE(a.is_known() && b.is_known());
        EXPECT_NEAR(a.depth_m, b.depth_m, 0.3e-6) << path << ' ' << step;
        if (glm::distance(a.p_CQ_C, b.p_CQ_C) > 1e-6) continue;  // of two peaks as high either may be taken
        EXPECT_LT((a.gradient - b.gradient).norm(), 1e-3);
      }
    }
  }
}

/// What the hand feels is the derivative of what it stores: with the contact's frame held, the gradient is the
/// difference of the back end's own depths, although it sums them over few nodes.
TEST(Simd, TheGradientIsTheDerivativeOfItsOwnDepth) {
  const auto simd = make_simd({.coarse_triangles = 8});
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates crossed(waves({}, 1.5e-3, 0.2e-3, 0), waves({}, 2.2e-3, 0.2e-3, 1.1));
  Plates coarse(waves({}, 3.7e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  constexpr double kStep = 1e-6;  // [m], [rad]
  std::vector<double> errors;
  for (Plates* plates : {&crossed, &coarse}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const spatial::Pose X_CT{
          spatial::rotation_from_vector({0.01 * unit(random), 0.01 * unit(random), 3 * unit(random)}) * kTurnedOver,
          1e-3 * glm::dvec3{unit(random), unit(random), 0.1 * unit(random)}};
      const auto at = [&](const glm::dvec3& turn, const glm::dvec3& move) {
        plates->X_CT = {spatial::rotation_from_vector(turn) * X_CT.R, X_CT.p + move};
        Query query = plates->query();
        query.wants_hessian = false;
        return evaluate(*simd, query);
      };
      at({}, {});  // the step that suits this place
      const Penetration here = at({}, {});
      spatial::Vector6 difference;
      for (int k = 0; k < 3; ++k) {
        glm::dvec3 e{0};
        e[k] = kStep;
        difference[k] = (at(e, {}).depth_m - at(-e, {}).depth_m) / (2 * kStep);
        difference[k + 3] = (at({}, e).depth_m - at({}, -e).depth_m) / (2 * kStep);
      }
      const double moved = (difference - here.gradient).tail<3>().norm(),
                   turned = (difference - here.gradient).head<3>().norm() / 0.01;
      errors.push_back(std::max(moved, turned) / here.gradient.tail<3>().norm());
    }
  }
  std::sort(errors.begin(), errors.end());
  RecordProperty("median", std::to_string(errors[errors.size() / 2]));
  EXPECT_LT(errors[errors.size() / 2], 1e-3);
  EXPECT_LT(errors[errors.size() * 95 / 100], 5e-3) << "where cells come into the sum or leave it";
}

/// The bound that is stated in simd.h.
TEST(Simd, InstructionSetsAgree) {
  const auto best = make_simd({.coarse_triangles = 8}),
             avx2 = make_simd({.coarse_triangles = 8}, InstructionSet::kAvx2),
             plain = make_simd({.coarse_triangles = 8}, InstructionSet::kPlain);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates plates(waves({}, 1.5e-3, 0.3e-3, 0), waves({}, 4.2e-3, 0.6e-3, 0.9));
  for (int trial = 0; trial < kTrials; ++trial) {
    plates.X_CT.R =
        spatial::rotation_from_vector({0.05 * unit(random), 0.05 * unit(random), 3 * unit(random)}) * kTurnedOver;
    plates.X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
    const Penetration a = evaluate(*best, plates.query());
    for (BackEnd* other : {avx2.get(), plain.get()}) {
      const Penetration b = evaluate(*other, plates.query());
      EXPECT_NEAR(a.depth_m, b.depth_m, 20e-9);
      EXPECT_LT((a.gradient - b.gradient).tail<3>().norm(), 1e-3);
    }
  }
}

/// A second layer 8 mm above the touched one: only named triangles count, layers are told, and too deep ones ignored.
TEST(Simd, LayersAreTreatedAsInTheReference) {
  const auto simd = make_simd({.coarse_triangles = 8}), reference = make_reference({.coarse_triangles = 8});
  const geometry::HapticSurface layer = flat_plate({}), both = support::stacked(layer, layer, {0, 0, 8e-3});
  Plates plates(both, flat_plate({}));
  plates.X_CT.p.z = -0.1e-3;
  const std::vector<std::uint32_t> near{0, 1}, all{0, 1, 2, 3};
  for (const std::vector<std::uint32_t>& s_triangles : {near, all}) {
    for (const double deepest_m : {1e-3, 1.0}) {
      for (const double w : {0.0, kDefaultSoftWidth_m}) {
        Query query = plates.query(w);
        query.s.triangles = s_triangles;
        query.t.triangles = near;
        query.deepest_m = deepest_m;
        const Penetration a = evaluate(*simd, query), b = evaluate(*reference, query);
        ASSERT_EQ(a.is_known(), b.is_known());
        // Both layers are in reach, and neither is a contact's: the upper one lies deeper than may be looked for.
        ASSERT_EQ(a.is_known(), s_triangles.size() == 2 || deepest_m > 8e-3) << s_triangles.size() << ", " << deepest_m;
        if (!a.is_known()) continue;
        EXPECT_NEAR(a.depth_m, b.depth_m, 0.3e-6);
        EXPECT_EQ(a.doubts & kSeveralLayers, b.doubts & kSeveralLayers);
        EXPECT_NEAR(a.depth_m, s_triangles.size() == 2 ? 0.1e-3 : 8.1e-3, 0.1e-3);
      }
    }
  }
}

/// Charts that lean up to 35 degrees from the direction: much parallax, and Newton from the coarse facet.
TEST(Simd, LeaningChartsAgreeWithTruth) {
  const auto simd = make_simd({.coarse_triangles = 8});
  const auto truth = make_reference({.coarse_triangles = 8}, kTruth);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  Plates plates(waves({}, 1.5e-3, 0.2e-3, 0.2), waves({}, 2.2e-3, 0.2e-3, 1.1));
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
    const Penetration fast = evaluate(*simd, query), exact = evaluate(*truth, query);
    ASSERT_TRUE(fast.is_known() && exact.is_known());
    EXPECT_NEAR(fast.depth_m, exact.depth_m, exact.doubts & kBorder ? 1e-6 : 0.3e-6) << trial;
    EXPECT_LT((fast.gradient - exact.gradient).tail<3>().norm(), 0.03) << trial;
  }
}

/// Two teeth that meet at their corners, steep: most of the weight lies within a few micrometres.
TEST(Simd, SteepCornersAreResolved) {
  const auto simd = make_simd({.coarse_triangles = 8});
  const auto truth = make_reference({.coarse_triangles = 8}, kTruth);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  Plates plates(flat_plate({.width_m = 0.004, .depth_m = 0.004}), flat_plate({.width_m = 0.004, .depth_m = 0.004}));
  for (int trial = 0; trial < kTrials; ++trial) {
    plates.X_CT.R =
        spatial::rotation_from_vector({0.3 + 0.3 * unit(random), 0.3 + 0.3 * unit(random), 0}) * kTurnedOver;
    plates.X_CT.p = {0.003 + 0.0005 * unit(random), 0.003 + 0.0005 * unit(random), 0.001};
    Query query = plates.query();
    query.window = {{-0.002, -0.002}, {0.003, 0.003}};
    const Penetration fast = evaluate(*simd, query), exact = evaluate(*truth, query);
    ASSERT_TRUE(fast.is_known() && exact.is_known());
    EXPECT_NEAR(fast.depth_m, exact.depth_m, 2e-6) << trial;
    EXPECT_LT((fast.gradient - exact.gradient).tail<3>().norm(), 0.05 * exact.gradient.tail<3>().norm()) << trial;
    EXPECT_EQ(fast.doubts & kSilhouette, kSilhouette);
  }
}

INSTANTIATE_TEST_SUITE_P(Widths, SimdAgainstTruth,
                         testing::Values(InstructionSet::kPlain, InstructionSet::kAvx2, InstructionSet::kAvx512),
                         [](const auto& set) {
                           return std::string(set.param == InstructionSet::kPlain  ? "plain"
                                              : set.param == InstructionSet::kAvx2 ? "avx2"
                                                                                   : "avx512");
                         });

}  // namespace
}  // namespace farfeel::penetration
