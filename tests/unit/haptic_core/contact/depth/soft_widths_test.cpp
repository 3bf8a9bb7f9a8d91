#include "haptic_core/contact/depth/soft_widths.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "haptic_core/contact/penalty.h"
#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/height_plate.h"
#include "tests/support/solids.h"

namespace farfeel::contact {
namespace {

using contact_service::ContactService;

const Material kSmooth{.static_friction = 0, .dynamic_friction = 0};
const glm::dquat kTurnedOver{0, 1, 0, 0};
constexpr double kHeld_N_per_m = 4000;

/// Two crests of equal height 1 mm apart, and a round tip between them.
struct Peaks {
  geometry::HapticSurface s = slave_sim::height_plate(
                              [](double x_m, double y_m) {
                                const double left = x_m + 0.5e-3, right = x_m - 0.5e-3;
                                return -std::min(left * left, right * right) / 1e-3 - y_m * y_m / 10e-3;
                              },
                              {.size_m = {0.006, 0.006, 0.004}, .texel_m = 2e-5}),
                          t = slave_sim::height_plate(
                              [](double x_m, double y_m) { return -(x_m * x_m + y_m * y_m) / 0.8e-3; },
                              {.size_m = {0.004, 0.004, 0.004}, .texel_m = 2e-5});

  [[nodiscard]] ContactService service(double most_N_per_m) const {
    const contact_service::TouchableObject object{.felt = &s, .material = kSmooth, .X_WO = {}};
    return {{&object, 1}, {.felt = &t, .material = kSmooth, .X_WO = {}}, {.most_stiffness_N_per_m = most_N_per_m}};
  }
};

contact_service::ToolPose pose(double x_m, double depth_m, double time_ms) {
  return {.time_ns = std::llround(1e6 * time_ms), .X_WT = {kTurnedOver, {x_m, 0, -depth_m}}, .V_WT_W = {}};
}

/// -dF_x / dx about x = 0; no time passes, so no width changes.
double sideways_N_per_m(ContactService& service, double depth_m, double time_ms) {
  constexpr double kStep_m = 2e-6;
  const double up_N = service.answer(pose(kStep_m, depth_m, time_ms)).F_To_W.force_N.x;
  const double down_N = service.answer(pose(-kStep_m, depth_m, time_ms)).F_To_W.force_N.x;
  return -(up_N - down_N) / (2 * kStep_m);
}

/// With rotations as lengths at an arm of 10 mm.
double largest_stiffness_N_per_m(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                                 const spatial::Matrix6& hessian) {
  spatial::Vector6 lengths = spatial::Vector6::Ones();
  lengths.head<3>().setConstant(1 / 0.01);
  const spatial::Vector6 g = lengths.asDiagonal() * gradient;
  const spatial::Matrix6 K =
      k_N_per_m * (g * g.transpose() + depth_m * (lengths.asDiagonal() * hessian * lengths.asDiagonal()));
  return Eigen::SelfAdjointEigenSolver<spatial::Matrix6>(K, Eigen::EigenvaluesOnly).eigenvalues()[5];
}

TEST(SoftWidths, AStiffnessIsBoundedByThatOfTheWorstDirectionAndAnEighthMore) {
  spatial::Vector6 g = spatial::Vector6::Zero();
  g[5] = -1;
  spatial::Matrix6 H = spatial::Matrix6::Zero();
  const auto expect_bound = [&](double largest_N_per_m) {
    EXPECT_NEAR(largest_stiffness_N_per_m(1000, 1e-3, g, H), largest_N_per_m, 1e-9);
    const double bound_N_per_m = stiffness_bound_N_per_m(1000, 1e-3, g, H, 0.01);
    EXPECT_GE(bound_N_per_m, largest_N_per_m * (1 - 1e-12));
    EXPECT_LE(bound_N_per_m, 1.125 * largest_N_per_m);
  };
  expect_bound(1000);
  H(3, 3) = 5000;  // sideways: k depth H = 5000
  expect_bound(5000);
  H(0, 0) = 2;  // a rotation's 2 m/rad^2 at that arm are 20,000 / m
  expect_bound(20'000);
  H.setZero();
  H.diagonal().tail<3>().setConstant(4000);  // as many as large as it: the bound is at its loosest
  expect_bound(5000);
  H(0, 0) = std::nan("");
  EXPECT_EQ(stiffness_bound_N_per_m(1000, 1e-3, g, H, 0.01), 0);
}

TEST(SoftWidths, BetweenTwoPeaksTheyWidenUntilTheLoopCanHoldIt) {
  const Peaks peaks;
  ContactService sharp = peaks.service(0), held = peaks.service(kHeld_N_per_m);
  constexpr double kDepth_m = 0.4e-3;
  double time_ms = 0, width_m = 10e-6;
  for (int i = 0; i < 30; ++i, time_ms += 1) {
    EXPECT_EQ(sharp.answer(pose(0, kDepth_m, time_ms)).times.widest_m, 10e-6);
    const double now_m = held.answer(pose(0, kDepth_m, time_ms)).times.widest_m;
    if (i > 2) {  // at first it may be anything: nothing was felt before
      EXPECT_LE(now_m, width_m * std::exp(1 / 2.0) * (1 + 1e-9)) << "faster than e-fold in 2 ms";
    }
    width_m = now_m;
  }
  EXPECT_GT(width_m, 15e-6);
  EXPECT_GT(sideways_N_per_m(sharp, kDepth_m, time_ms - 1), 1.3 * kHeld_N_per_m);
  EXPECT_LT(sideways_N_per_m(held, kDepth_m, time_ms - 1), 1.1 * kHeld_N_per_m);
}

TEST(SoftWidths, TheyNarrowSlowlyAndOnlyWhereContactsAreClearlySofter) {
  SoftWidths widths({.most_stiffness_N_per_m = kHeld_N_per_m});
  spatial::Vector6 g = spatial::Vector6::Zero();
  g[5] = -1;
  spatial::Matrix6 H = spatial::Matrix6::Zero();
  const auto after = [&](int answers, double sideways_N_per_m) {
    H(3, 3) = sideways_N_per_m;  // of a spring of 1 N/m pressed in by 1 m
    for (int i = 0; i < answers; ++i) {
      widths.begin_answer(1e-3);
      widths.note(1, 1, 1);
      widths.judge(1, 1, 1, g, H, 0.01);
    }
    return widths.width_m(1);
  };
  EXPECT_NEAR(after(20, 5 * kHeld_N_per_m), 200e-6, 1e-9);
  EXPECT_NEAR(after(500, 0.7 * kHeld_N_per_m), 200e-6, 1e-9) << "nearly as stiff as before";
  const double a_while_m = after(30, 0.1 * kHeld_N_per_m);
  EXPECT_LT(a_while_m, 199e-6);
  EXPECT_GT(a_while_m, 170e-6);
  EXPECT_NEAR(after(9000, 0.1 * kHeld_N_per_m), 10e-6, 1e-7);
}

/// A crest of 28 mm between two others, tilted while nobody asks so that its witness jumps from end to end.
TEST(SoftWidths, AContactThatIsRenamedStaysAsWideAsItWas) {
  const geometry::HapticSurface s = slave_sim::height_plate(
                                    [](double x_m, double) {
                                      const double left = x_m + 0.5e-3, right = x_m - 0.5e-3;
                                      return -std::min(left * left, right * right) / 1e-3;
                                    },
                                    {.size_m = {0.006, 0.030, 0.004}, .texel_m = 5e-5}),
                                t = slave_sim::height_plate([](double x_m, double) { return -x_m * x_m / 0.8e-3; },
                                                            {.size_m = {0.004, 0.028, 0.004}, .texel_m = 5e-5});
  const contact_service::TouchableObject object{.felt = &s, .material = kSmooth, .X_WO = {}};
  ContactService service{
      {&object, 1}, {.felt = &t, .material = kSmooth, .X_WO = {}}, {.most_stiffness_N_per_m = kHeld_N_per_m}};
  double widest_m = 0;
  std::uint32_t names = 0;
  ContactId id;
  for (int i = 0; i < 200; ++i) {
    contact_service::ToolPose tool = pose(0, 0.3e-3, i);
    tool.time_ns += i / 20 * 100'000'000;
    tool.X_WT.R = spatial::rotation_from_vector({i / 20 % 2 == 0 ? 0.002 : -0.002, 0, 0}) * kTurnedOver;
    const Answer& set = service.answer(tool);
    ASSERT_EQ(set.count, 1u);
    const double now_m = set.times.widest_m;
    if (set.contacts[0].id != id) {
      EXPECT_GE(now_m, 0.99 * widest_m) << i;
      id = set.contacts[0].id;
      ++names;
    }
    widest_m = now_m;
  }
  EXPECT_GT(names, 5u);
  EXPECT_GT(widest_m, 15e-6);
}

TEST(SoftWidths, ALightTouchStaysAsSharpAsAskedForAndCostsNoHessian) {
  const Peaks peaks;
  ContactService service = peaks.service(kHeld_N_per_m);
  for (int i = 0; i < 10; ++i) {
    const StageTimes& times = service.answer(pose(0.5e-3, -0.05e-3, i)).times;
    EXPECT_EQ(times.widest_m, 10e-6);
    EXPECT_EQ(times.hessians, 0u);
  }
}

}  // namespace
}  // namespace farfeel::contact
