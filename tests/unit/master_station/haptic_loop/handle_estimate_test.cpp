#include "master_station/haptic_loop/handle_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace farfeel::master_station {
namespace {

constexpr double kStep_m = 20e-6, kStep_rad = 1e-4, kTick_s = 2e-4;

DeviceCapabilities counting() {
  DeviceCapabilities device;
  device.position_step_m = kStep_m;
  device.rotation_step_rad = kStep_rad;
  return device;
}

spatial::Pose counted(const glm::dvec3& p_m, const glm::dvec3& turn_rad) {
  return {spatial::rotation_from_vector(kStep_rad * glm::round(turn_rad / kStep_rad)),
          kStep_m * glm::round(p_m / kStep_m)};
}

double off_rad(const spatial::Pose& a, const spatial::Pose& b) {
  return glm::length(spatial::vector_from_rotation(a.R * glm::conjugate(b.R)));
}

TEST(HandleEstimate, StaysOnABorderThatTheReadingCrossesToAndFro) {
  HandleEstimate estimate(counting());
  const glm::dvec3 border_m{3.5 * kStep_m, 0, -7.5 * kStep_m}, border_rad{0, 12.5 * kStep_rad, 0};
  spatial::Pose X_BD;
  double farthest_m = 0, farthest_rad = 0;
  for (int i = 0; i < 4000; ++i) {
    const double side = i / 8 % 2 == 0 ? 1e-6 : -1e-6;  // 313 Hz
    X_BD = estimate.next(counted(border_m * (1 + side), border_rad * (1 + side)), kTick_s);
    if (i < 100) continue;
    farthest_m = std::max(farthest_m, glm::length(X_BD.p - border_m));
    farthest_rad = std::max(farthest_rad, off_rad(X_BD, {spatial::rotation_from_vector(border_rad), {}}));
  }
  EXPECT_LT(farthest_m, 0.05 * kStep_m);
  EXPECT_LT(farthest_rad, 0.05 * kStep_rad);
}

TEST(HandleEstimate, IsWithinAStepOfEveryReadingAndSoonWithinHalf) {
  HandleEstimate estimate(counting());
  std::mt19937 random(1);
  std::normal_distribution<double> some;
  glm::dvec3 p_m{0.1, -0.2, 0.3}, turn_rad{0.3, 0.2, -0.1};
  for (int i = 0; i < 10000; ++i) {
    const double fast = std::exp(3 * some(random));
    p_m += 0.1 * kStep_m * fast * glm::dvec3(some(random), some(random), some(random));
    turn_rad += 0.1 * kStep_rad * fast * glm::dvec3(some(random), some(random), some(random));
    const spatial::Pose read = counted(p_m, turn_rad);
    const bool stays = i % 100 == 0;
    spatial::Pose X_BD = estimate.next(read, kTick_s);
    for (int k = 0; stays && k < 100; ++k) X_BD = estimate.next(read, kTick_s);
    const double most = stays ? 0.55 : 1;
    const glm::dvec3 off = glm::abs(X_BD.p - read.p);
    ASSERT_LE(std::max({off.x, off.y, off.z}), most * kStep_m * (1 + 1e-9));
    ASSERT_LE(off_rad(X_BD, read), most * std::sqrt(3) * kStep_rad * (1 + 1e-6));
  }
}

TEST(HandleEstimate, OfAHandleThatTurnedBackInsideAStepIsNeverMovedByAWholeOneAtOnce) {
  HandleEstimate estimate(counting());
  (void)estimate.next({}, kTick_s);
  glm::dvec3 last_m = estimate.next(counted({kStep_m, 0, 0}, {}), kTick_s).p;
  for (int i = 0; i < 10; ++i) last_m = estimate.next(counted({kStep_m, 0, 0}, {}), kTick_s).p;
  double largest_m = 0;
  for (int i = 0; i < 10; ++i) {
    const glm::dvec3 p_m = estimate.next(counted({2 * kStep_m, 0, 0}, {}), kTick_s).p;
    largest_m = std::max(largest_m, glm::length(p_m - last_m));
    last_m = p_m;
  }
  EXPECT_LT(largest_m, 0.6 * kStep_m);
}

TEST(HandleEstimate, DoesNotLagBehindAHandleThatMoves) {
  HandleEstimate estimate(counting());
  double lag_m = 0;
  constexpr int kTicks = 5000;
  for (int i = 0; i < kTicks; ++i) {
    const glm::dvec3 p_m{0.01 * kTick_s * i, 0, 0};  // 10 mm/s: a count in ten ticks
    lag_m += (p_m - estimate.next(counted(p_m, {}), kTick_s).p).x / kTicks;
  }
  EXPECT_LT(std::abs(lag_m), 0.16 * kStep_m);
}

TEST(HandleEstimate, ComesToAReadingThatStays) {
  HandleEstimate estimate(counting());
  (void)estimate.next({}, kTick_s);
  const spatial::Pose read = counted({5 * kStep_m, 0, 0}, {0, 0, 5 * kStep_rad});
  spatial::Pose X_BD = estimate.next(read, kTick_s);
  EXPECT_NEAR(glm::length(X_BD.p - read.p), kStep_m, 1e-12);
  for (int i = 0; i < 6000; ++i) X_BD = estimate.next(read, kTick_s);
  EXPECT_LT(glm::length(X_BD.p - read.p), 1e-4 * kStep_m);
  EXPECT_LT(off_rad(X_BD, read), 1e-3 * kStep_rad);
}

TEST(HandleEstimate, IsTheReadingOfADeviceWithoutSteps) {
  HandleEstimate estimate(DeviceCapabilities{});
  for (int i = 0; i < 10; ++i) {
    const spatial::Pose read{spatial::rotation_from_vector({0.1 * i, 0, 0}), {0.01 * i, 0, 0}};
    const spatial::Pose X_BD = estimate.next(read, kTick_s);
    EXPECT_EQ(X_BD.p, read.p);
    EXPECT_LT(off_rad(X_BD, read), 1e-12);
  }
}

TEST(HandleEstimate, BeginsAnewAfterAFault) {
  HandleEstimate estimate(counting());
  (void)estimate.next({}, kTick_s);
  estimate.forget();
  const spatial::Pose read = counted({0.1, 0, 0}, {});
  EXPECT_EQ(estimate.next(read, kTick_s).p, read.p);
}

}  // namespace
}  // namespace farfeel::master_station
