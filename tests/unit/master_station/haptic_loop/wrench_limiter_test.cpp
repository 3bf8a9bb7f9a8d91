#include "master_station/haptic_loop/wrench_limiter.h"

#include <gtest/gtest.h>

namespace farfeel::master_station {
namespace {

DeviceCapabilities device() {
  DeviceCapabilities device;
  device.max_force_N = 10;
  device.max_torque_Nm = 1;
  device.max_force_rate_N_per_s = 1e6;
  device.max_power_W = 0.5;
  return device;
}

TEST(WrenchLimiterTest, DrivesTheHandWithNoMoreThanTheDevicesPower) {
  WrenchLimiter limiter(device());
  const spatial::Twist V{{0, 2, 0}, {0.3, 0, 0}};
  const spatial::Wrench F = limiter.limited({{0, 0.5, 0}, {6, 0, 0}}, V, 1e-3);
  EXPECT_NEAR(spatial::power_W(F, V), 0.5, 1e-12);
  EXPECT_NEAR(F.force_N.x / F.torque_Nm.y, 12, 1e-9) << "the wrench keeps its direction";
}

TEST(WrenchLimiterTest, BrakesTheHandWithAllItsForce) {
  WrenchLimiter limiter(device());
  const spatial::Wrench F = limiter.limited({{}, {-6, 0, 0}}, {{}, {1, 0, 0}}, 1e-3);
  EXPECT_DOUBLE_EQ(F.force_N.x, -6);
}

TEST(WrenchLimiterTest, AForceThatReturnsRisesSlowlyAndFallsAtOnce) {
  WrenchLimiter limiter(device());
  for (int tick = 1; tick <= 10; ++tick)
    EXPECT_NEAR(glm::length(limiter.limited({{}, {0, 6, 0}}, {}, 1e-3, true).force_N), 0.2 * tick, 1e-9);
  EXPECT_NEAR(limiter.limited({{}, {0, 1, 0}}, {}, 1e-3, true).force_N.y, 1, 1e-9);
  EXPECT_NEAR(limiter.limited({{}, {0, 6, 0}}, {}, 1e-3).force_N.y, 6, 1e-9) << "once it is back, as ever";
}

}  // namespace
}  // namespace farfeel::master_station
