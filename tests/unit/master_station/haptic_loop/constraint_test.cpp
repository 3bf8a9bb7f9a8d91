// The loop with contacts as constraints: the tool sinks into the pad, its proxy stays on the surface.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/master_station/haptic_loop/rig.h"

namespace farfeel::master_station {
namespace {

constexpr double kPress_N = 3, kBottom_m = 0.003;  // the tool's corners lie so much below its origin

Rig constraint_rig(double round_trip_s = 0) {
  return Rig(kMediumGrip, round_trip_s, 500, local_model::Rung::kLinear, {}, tool::Integrator::kBackwardEuler,
             local_model::ContactLaw::kConstraint);
}

TEST(Constraint, AToolThatIsPressedSinksAndItsProxyStaysOnTheSurface) {
  Rig rig = constraint_rig();
  for (int i = 0; i < 500; ++i) rig.tick();
  rig.hold(kPress_N);
  TickRecord record;
  for (int i = 0; i < 2000; ++i) record = rig.tick();
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  EXPECT_GT(record.F_hand_W.force_N.z, 1);
  EXPECT_EQ(record.contacts, 4u);
  EXPECT_NEAR(record.X_WT.p.z, kBottom_m, 20e-6);
  EXPECT_LT(record.depth_max_m, 20e-6);
  // Four corners of k each share one pad of k.
  const double k = rig.remote.world.material.stiffness_N_per_m;
  EXPECT_NEAR(kBottom_m - rig.loop.tool().X_WT.p.z, record.F_contact_To_W.force_N.z / k, 50e-6);
  EXPECT_EQ(record.X_WT.p, rig.loop.X_WP().p);
}

TEST(Constraint, TheRemoteIsToldOfTheProxy) {
  Rig rig = constraint_rig();
  for (int i = 0; i < 500; ++i) rig.tick();
  rig.hold(kPress_N);
  TickRecord record;
  for (int i = 0; i < 1000; ++i) record = rig.tick();
  EXPECT_EQ(rig.remote.sent.X_WT.p, record.X_WT.p);
  EXPECT_GT(glm::distance(rig.remote.sent.X_WT.p, rig.loop.tool().X_WT.p), 0.2e-3);
}

TEST(Constraint, AHandThatExploresAcrossALinkGetsNoMoreThanTankAndAllowance) {
  Rig rig = constraint_rig(0.1);
  for (int i = 0; i < 8000; ++i) rig.tick();
  EXPECT_EQ(rig.loop.fault(), Fault::kNone);
  const local_model::LocalModel& model = rig.loop.local_model();
  EXPECT_GE(rig.device.hand_port().least_J(), -(passivity::TankSettings{}.cap_J + model.tank().allowed_J()));
}

TEST(Constraint, WithoutContactTheProxyIsTheTool) {
  Rig rig = constraint_rig();
  rig.remote.world.level_m = -0.2;
  for (int i = 0; i < 1000; ++i) rig.tick();
  EXPECT_EQ(rig.loop.X_WP().p, rig.loop.tool().X_WT.p);
}

}  // namespace
}  // namespace farfeel::master_station
