#include <gtest/gtest.h>

#include "haptic_core/passivity/energy_tank.h"
#include "haptic_core/passivity/port_observer.h"

namespace farfeel::passivity {
namespace {

TEST(EnergyTankTest, GivesOnlyWhatItGotAndCountsWhatItGaveForNothing) {
  EnergyTank tank({.cap_J = 0.01, .allowance_W = 0});
  EXPECT_EQ(tank.take(1), 0);
  tank.add(0.004);
  EXPECT_DOUBLE_EQ(tank.take(0.001), 0.001);
  EXPECT_DOUBLE_EQ(tank.take(1), 0.003);
  tank.add(1);
  EXPECT_DOUBLE_EQ(tank.level_J(), 0.01);  // the cap
  tank.pass(10);
  EXPECT_EQ(tank.allowed_J(), 0);

  EnergyTank generous({.cap_J = 0.01, .allowance_W = 0.002});
  generous.pass(1);
  EXPECT_DOUBLE_EQ(generous.level_J(), 0.002);
  generous.pass(100);
  EXPECT_DOUBLE_EQ(generous.level_J(), 0.01);
  EXPECT_DOUBLE_EQ(generous.allowed_J(), 0.01);
}

TEST(EnergyTankTest, ADebtIsPaidBeforeAnythingIsGiven) {
  EnergyTank tank({.cap_J = 0.01, .allowance_W = 0});
  tank.add(-0.002);
  EXPECT_EQ(tank.take(1), 0);
  tank.add(0.003);
  EXPECT_NEAR(tank.take(1), 0.001, 1e-15);
}

TEST(PortObserverTest, AddsTorqueTimesTurningAndForceTimesMoving) {
  PortObserver port;
  port.observe({{1, 0, 0}, {0, 2, 0}}, {{3, 0, 0}, {0, 0.5, 0}}, 0.1);
  EXPECT_DOUBLE_EQ(port.energy_J(), 0.4);
  port.observe({{0, 0, 0}, {0, 2, 0}}, {{0, 0, 0}, {0, -3, 0}}, 0.1);
  port.add(1);
  EXPECT_DOUBLE_EQ(port.least_J(), -0.2);
  EXPECT_DOUBLE_EQ(port.energy_J(), 0.8);
}

}  // namespace
}  // namespace farfeel::passivity
