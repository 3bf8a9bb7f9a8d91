// The whole tick: how stiff walls feel through the coupling, and that it takes no memory.
#include "haptic_core/constraint/tool_step.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "tests/support/realtime_guard.h"
#include "tests/support/row_loop.h"

namespace farfeel::constraint {
namespace {

using spatial::Pose;
using spatial::Vector6;
using test_support::RowLoop;
using test_support::Scene;

constexpr tool::CouplingGains kGains{2000, 1, 5, 0.005};
constexpr double kShare_N_per_m = 2000.0 * 1000 / 3000;  // K k / (K + k)

Scene planes(const std::vector<glm::dvec3>& normals) {
  return [normals](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const glm::dvec3& n : normals) rows.push_back(test_support::point_on_plane(X_WQ, {}, glm::normalize(n), 0));
    test_support::name_in_order(rows);
  };
}

/// Force per way of a handle that pressed 3 mm.
double felt_N_per_m(const Scene& scene, const Law& law, double dt_s = 1e-3) {
  RowLoop loop({}, kGains, law, dt_s, {});
  for (double t = 0; t < 0.5; t += dt_s) loop.tick({{1, 0, 0, 0}, {0, 0, -3e-3 * std::min(1.0, t / 0.2)}}, scene);
  return loop.on_hand().force_N.z / 3e-3;
}

glm::dvec3 tilted(double degrees) {
  return {std::sin(degrees * M_PI / 180), 0, std::cos(degrees * M_PI / 180)};
}

TEST(ToolStep, OneContactFeelsLikePadAndCouplingInSeries) {
  for (const double dt_s : {1e-3, 0.2e-3})
    EXPECT_NEAR(felt_N_per_m(planes({{0, 0, 1}}), one_pad(2000), dt_s), kShare_N_per_m, 0.003 * kShare_N_per_m);
}

TEST(ToolStep, DuplicatesAndWallsAtAnyAngleFeelLikeOne) {
  const double one = felt_N_per_m(planes({{0, 0, 1}}), one_pad(2000));
  EXPECT_NEAR(felt_N_per_m(planes(std::vector<glm::dvec3>(8, {0, 0, 1})), one_pad(2000)), one, 0.01 * one);
  for (const double half_angle : {15.0, 45.0})
    EXPECT_NEAR(felt_N_per_m(planes({tilted(half_angle), tilted(-half_angle)}), one_pad(2000)), one, 0.01 * one);
  // What springs make of them: the comparator.
  EXPECT_NEAR(felt_N_per_m(planes(std::vector<glm::dvec3>(8, {0, 0, 1})), springs()), 2000.0 * 8000 / 10'000, 20);
}

TEST(ToolStep, OfTwoMaterialsAtOnePlaceTheStifferIsFelt) {
  const Scene scene = [](const Pose& X_WQ, std::vector<Row>& rows) {
    for (const double k : {500.0, 1000.0})
      rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0, {.stiffness_N_per_m = k}));
    test_support::name_in_order(rows);
  };
  EXPECT_NEAR(felt_N_per_m(scene, one_pad(2000)), kShare_N_per_m, 0.004 * kShare_N_per_m);
}

TEST(ToolStep, AContactAtALeverFeelsLikeThePadInSeriesWithTheWholeCoupling) {
  for (const double lever_m : {0.0, 0.01, 0.03}) {
    const Pose X_TG{{1, 0, 0, 0}, {0, 0, 0.05}};
    RowLoop loop({}, kGains, one_pad(2000), 1e-3, {}, X_TG);
    const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      rows.push_back(test_support::point_on_plane(X_WQ, {lever_m, 0, 0}, {0, 0, 1}, 0));
    };
    const double way_m = 0.2e-3;  // small, so that the lever hardly turns
    for (int i = 0; i < 3000; ++i)
      loop.tick({{1, 0, 0, 0}, glm::dvec3(0, 0, 0.05 - way_m * std::min(1.0, i / 500.0))}, scene);
    // A push at C turns the tool about the grip: 1 / (1/k + 1/K + lever^2 / k_r).
    const double expected = 1 / (1.0 / 1000 + 1.0 / 2000 + lever_m * lever_m / 5);
    EXPECT_NEAR(loop.on_hand().force_N.z / way_m, expected, 0.004 * expected) << lever_m;
  }
}

TEST(ToolStep, ARowThatBlinksIsNotFelt) {
  std::mt19937 random(2);
  for (const bool is_aside : {false, true}) {
    RowLoop loop({}, kGains, one_pad(2000), 1e-3, {});
    std::array<bool, 8> is_there{};
    const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0));
      for (std::size_t i = 0; i < (is_aside ? 1 : is_there.size()); ++i)
        if (is_there[i]) rows.push_back(test_support::point_on_plane(X_WQ, {}, is_aside ? tilted(20) : tilted(0), 0));
      test_support::name_in_order(rows);
    };
    double sum = 0, squares = 0;
    for (int i = 0; i < 3000; ++i) {
      if (i % 5 == 0)
        for (bool& there : is_there) there = random() & 1;
      loop.tick({{1, 0, 0, 0}, {0, 0, -3e-3 * std::min(1.0, i / 300.0)}}, scene);
      if (i < 2000) continue;
      const double force_N = glm::length(loop.on_hand().force_N);
      sum += force_N / 1000, squares += force_N * force_N / 1000;
    }
    EXPECT_LE(std::sqrt(std::max(0.0, squares - sum * sum)), 1e-3 * sum) << is_aside;
  }
}

TEST(ToolStep, AMovingSurfaceTakesWhatSticksAlong) {
  RowLoop loop({}, kGains, one_pad(2000), 1e-3, {});
  const glm::dvec3 v{1e-3, 0, 0};
  for (int i = 0; i < 1000; ++i)
    loop.tick({{1, 0, 0, 0}, {0, 0, -3e-3 * std::min(1.0, i / 100.0)}}, [&](const Pose& X_WQ, std::vector<Row>& rows) {
      rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, 0, {.friction = 1}));
      if (i >= 500) rows.back().V_WS_W.tail<3>() = spatial::to_eigen(v);
    });
  EXPECT_NEAR(loop.touching().X_WP.p.x, 0.5e-3, 1e-6);
  // 0.5 mm away, the coupling and the pad pull it back.
  EXPECT_NEAR(loop.on_hand().force_N.x, 0.5e-3 * kShare_N_per_m, 0.02);
}

TEST(ToolStep, TakesNoMemoryAndNoLock) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "a sanitizer needs malloc itself";
  std::mt19937 random(9);
  std::normal_distribution<> normal;
  const auto normal3 = [&](double size) { return size * glm::dvec3(normal(random), normal(random), normal(random)); };
  const tool::VirtualCoupling coupling(kGains, {});
  TouchingTool touching = untouched({});
  const std::uint64_t before = test_support::RealtimeGuard::violations();
  for (int i = 0; i < 2000; ++i) {
    std::vector<Row> rows;
    for (int k = 0; k < i % (kMaxRows + 3); ++k) {  // more than it holds, too
      rows.push_back(test_support::point_on_plane(touching.X_WP, normal3(0.02), glm::normalize(normal3(1)), 0,
                                                  {.friction = k % 3 ? 0.3 : 0}));
      rows.back().depth_m = 1e-4 * normal(random);
      rows.back().patch_radius_m = k % 2 ? 1e-3 : 0;
    }
    test_support::name_in_order(rows);
    const test_support::RealtimeGuard guard;
    const Law law = i % 2 ? one_pad(2000) : springs();
    const auto others = coupling.evaluate({}, {}, touching.tool.X_WT, touching.tool.V_WT_W).on_tool;
    const TickReport report = take_tick(touching, others, rows, where_to_look(touching, 1e-3, law.pad), 1e-3, law);
    if (!report.contacts.is_solved) break;
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
  EXPECT_TRUE(spatial::is_valid(touching.tool.X_WT));
}

}  // namespace
}  // namespace farfeel::constraint
