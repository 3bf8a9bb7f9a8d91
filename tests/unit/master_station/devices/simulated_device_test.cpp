#include "master_station/devices/simulated_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

SimulatedDeviceSettings over_a_face(const Grip& grip = kMediumGrip, std::uint64_t seed = 1) {
  SimulatedDeviceSettings settings;
  settings.grip = grip;
  settings.explorer.seed = seed;
  settings.explorer.hints.region_low_W = {-0.04, -0.03, -0.005};
  settings.explorer.hints.region_high_W = {0.04, 0.03, 0.005};
  return settings;
}

/// A frictionless wall z = 0 that the actuators render directly.
spatial::Wrench wall(const DeviceState& state) {
  const double depth_m = -state.X_BD.p.z;
  return {{0, 0, 0}, {0, 0, depth_m > 0 ? 1500 * depth_m - 1 * state.V_BD_B.linear_m_s.z : 0}};
}

TEST(SimulatedDeviceTest, TheSameSeedMovesTheSameAndAnotherSeedDoesNot) {
  SimulatedDevice a(over_a_face()), b(over_a_face()), c(over_a_face(kMediumGrip, 2));
  for (int i = 0; i < 2000; ++i) {
    const std::int64_t time_ns = 77 + i * kMillisecond_ns;
    const DeviceState state = a.read(time_ns);
    ASSERT_EQ(state.X_BD, b.read(time_ns).X_BD);
    (void)c.read(time_ns);
    a.write(wall(state));
    b.write(wall(state));
  }
  EXPECT_NE(a.true_pose(), c.true_pose());
}

TEST(SimulatedDeviceTest, EncodersCountInStepsNearTheTruth) {
  const SimulatedDeviceSettings settings = over_a_face();
  SimulatedDevice device(settings);
  for (int i = 0; i < 500; ++i) {
    const DeviceState state = device.read(i * kMillisecond_ns);
    EXPECT_LE(glm::length(state.X_BD.p - device.true_pose().p), settings.model.position_step_m);
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = state.X_BD.p[axis] / settings.model.position_step_m;
      EXPECT_NEAR(steps, std::round(steps), 1e-6);
    }
  }
}

TEST(ExplorerTest, PressesWithWhatItSaysAtMostAndThenLifts) {
  constexpr double kWall_N_per_m = 700;
  ExplorerSettings settings{over_a_face().explorer.hints, {}, kMediumGrip.stiffness_N_per_m, 1};
  settings.hints.press_force_N = 1000;
  Explorer explorer(settings);
  double most_N = 0;
  bool has_lifted = false;
  for (int i = 0; i < 5000; ++i) {
    const double above_m = explorer.X_WHand().p.z - settings.hints.region_high_W.z;  // the wall may stand so high
    const double felt_N = std::max(0.0, -kWall_N_per_m * above_m);
    most_N = std::max(most_N, felt_N);
    explorer.advance({{0, 0, 0}, {0, 0, felt_N}});
    has_lifted = has_lifted || explorer.phase() == Explorer::Phase::kLift;
  }
  EXPECT_TRUE(has_lifted);
  const double said_N = Explorer::most_press_N(settings.hints, kWall_N_per_m);
  EXPECT_LT(most_N, 1.01 * said_N);
  EXPECT_GT(most_N, 0.97 * said_N);
}

TEST(SimulatedDeviceTest, TheHandPressesWithTheForceItWantsAndStaysInItsRegion) {
  std::uint64_t seed = 0;
  for (const Grip& grip : {kSoftGrip, kMediumGrip, kHardGrip}) {
    ++seed;
    const SimulatedDeviceSettings settings = over_a_face(grip, seed);
    SimulatedDevice device(settings);
    double sum_N = 0, fastest = 0;
    int pressed = 0, reversals = 0, lifts = 0;
    double last_vx = 0;
    Explorer::Phase last_phase = Explorer::Phase::kApproach;
    for (int i = 0; i < 8'000; ++i) {
      const DeviceState state = device.read(i * kMillisecond_ns);
      const spatial::Wrench F = wall(state);
      device.write(F);
      if (F.force_N.z > 0) sum_N += F.force_N.z, ++pressed;
      const double vx = state.V_BD_B.linear_m_s.x;
      if (std::abs(vx) > 0.01) {
        reversals += vx * last_vx < 0;
        last_vx = vx;
      }
      fastest = std::max(fastest, glm::length(state.V_BD_B.linear_m_s));
      EXPECT_LE(std::abs(state.X_BD.p.x), 0.04 + 0.01);
      EXPECT_LE(std::abs(state.X_BD.p.y), 0.03 + 0.01);
      lifts += device.explorer().phase() == Explorer::Phase::kLift && last_phase != Explorer::Phase::kLift;
      last_phase = device.explorer().phase();
    }
    EXPECT_GE(pressed, 5'600) << grip.name;
    EXPECT_NEAR(sum_N / pressed, settings.explorer.hints.press_force_N, 0.3) << grip.name;
    EXPECT_GE(reversals, 1);
    EXPECT_GE(lifts, 1);
    EXPECT_LE(fastest, 0.5);
    EXPECT_GE(fastest, 0.1);
  }
}

TEST(SimulatedDeviceTest, EnergyOfTheHandAccountsForMotionAndLoss) {
  // With the actuators off, what the hand puts in is kinetic or lost to friction: never negative.
  SimulatedDevice device(over_a_face());
  for (int i = 0; i < 1000; ++i) (void)device.read(i * kMillisecond_ns);
  EXPECT_GE(device.hand_port().least_J(), -1e-9);
  EXPECT_EQ(device.actuator_port().energy_J(), 0);
}

TEST(SimulatedDeviceTest, ObeysItsActuatorsLimitsAndIgnoresWhatIsNotFinite) {
  SimulatedDeviceSettings settings = over_a_face();
  settings.model.max_force_N = 2;
  SimulatedDevice device(settings);
  device.hold_at(device.true_pose());
  const auto rest_z_m = [&](const spatial::Wrench& F) {
    device.write(F);
    static std::int64_t time_ns = 0;
    for (int i = 0; i < 1000; ++i) (void)device.read(time_ns += kMillisecond_ns);
    return device.true_pose().p.z;
  };
  const double free_m = rest_z_m({});
  EXPECT_NEAR(rest_z_m({{0, 0, 0}, {0, 0, 1e9}}) - free_m, 2 / kMediumGrip.stiffness_N_per_m, 5e-4);
  EXPECT_NEAR(rest_z_m({{0, 0, 0}, {0, 0, std::nan("")}}), free_m, 5e-4);
}

}  // namespace
}  // namespace farfeel::master_station
