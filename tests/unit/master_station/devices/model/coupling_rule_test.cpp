#include "master_station/devices/model/coupling_rule.h"

#include <gtest/gtest.h>

#include "master_station/haptic_loop/haptic_loop.h"

namespace farfeel::devices {
namespace {

constexpr std::int64_t kTick_ns = 1'000'000;

DeviceModel plain(double friction, double delay_s) {
  DeviceModel model;
  model.force_dof = 3;
  model.rate_Hz = 0;
  model.viscous_friction_Ns_per_m = friction;
  model.sensor_delay_s = 0.4 * delay_s;
  model.actuator_delay_s = 0.6 * delay_s;
  return model;
}

TEST(CouplingRuleTest, IsTheRule) {
  const Coupling prompt = coupling_of(plain(2, 0));
  EXPECT_DOUBLE_EQ(prompt.stiffness_N_per_m, 0.8 * 2 / 0.5e-3);
  EXPECT_EQ(prompt.damping_Ns_per_m, 0) << "without delay it only takes from the friction";
  const Coupling late = coupling_of(plain(2, 3e-3));
  EXPECT_DOUBLE_EQ(late.damping_Ns_per_m, 0.5);
  EXPECT_DOUBLE_EQ(late.stiffness_N_per_m, 0.8 * 2.5 / 3.5e-3);
  const Coupling limp = coupling_of(plain(2, 3e-3), Grasp::kLimp);
  EXPECT_DOUBLE_EQ(limp.damping_Ns_per_m, 1);
  EXPECT_DOUBLE_EQ(limp.stiffness_N_per_m, 0.85 * 3 / 3.5e-3);
}

TEST(CouplingRuleTest, AnExchangeOfItsOwnIsADelayAndHoldsTheForce) {
  DeviceModel model = plain(2, 0);
  model.rate_Hz = 500;
  EXPECT_DOUBLE_EQ(coupling_of(model).stiffness_N_per_m, 0.8 * 2.5 / (1e-3 + 2e-3));
  model.rate_Hz = 4000;  // faster than the tick, whose hold counts then
  EXPECT_DOUBLE_EQ(coupling_of(model).stiffness_N_per_m, 0.8 * 2.5 / (0.5e-3 + 0.25e-3));
}

TEST(CouplingRuleTest, WhatIsEstimatedCountsAtItsSofterEndAndIsTold) {
  DeviceModel model = plain(2, 2e-3);
  model.title = "Thing";
  const double published = coupling_of(model).stiffness_N_per_m;
  EXPECT_EQ(in_words(model, coupling_of(model)).find("nobody published"), std::string::npos);
  model.estimated = {"viscous_friction_Ns_per_m"};
  EXPECT_DOUBLE_EQ(coupling_of(model).stiffness_N_per_m, 0.5 * published);
  EXPECT_NE(in_words(model, coupling_of(model)).find("its friction (taken at half)"), std::string::npos);
  model.estimated = {"sensor_delay_s", "actuator_delay_s"};
  EXPECT_DOUBLE_EQ(coupling_of(model).stiffness_N_per_m, published * 2.5 / 3.5);
  EXPECT_NE(in_words(model, coupling_of(model)).find("half as long again"), std::string::npos);
}

TEST(CouplingRuleTest, WhatWasIdentifiedComesBeforeTheRule) {
  DeviceModel model = plain(2, 3e-3);
  model.coupling_stiffness_N_per_m = 300;
  model.coupling_damping_Ns_per_m = 0.1;
  model.estimated = {"viscous_friction_Ns_per_m"};
  const Coupling coupling = coupling_of(model, Grasp::kLimp);
  EXPECT_TRUE(coupling.is_identified);
  EXPECT_EQ(coupling.stiffness_N_per_m, 300);
  EXPECT_EQ(coupling.damping_Ns_per_m, 0.1);
}

TEST(CouplingRuleTest, TheStandardDeviceKeepsItsCoupling) {
  const tool::CouplingGains gains = master_station::coupling_for(capabilities_of(*find_model("simulated")), {},
                                                                 {0.05, Eigen::Matrix3d::Identity()}, kTick_ns);
  EXPECT_EQ(gains.stiffness_N_per_m, 2000);
  EXPECT_EQ(gains.damping_Ns_per_m, 1);
  EXPECT_EQ(gains.rotational_stiffness_Nm_per_rad, 6);
  EXPECT_EQ(gains.rotational_damping_Nms_per_rad, 0.003);
}

TEST(CouplingRuleTest, TheLoopScalesItByTickDelayAndExchange) {
  DeviceModel model = plain(2, 2e-3);
  const auto at = [&](std::int64_t tick_ns) {
    return master_station::coupling_for(capabilities_of(model), {}, {1e-3, Eigen::Matrix3d::Identity()}, tick_ns)
        .stiffness_N_per_m;
  };
  EXPECT_NEAR(at(2'000'000), 0.8 * 2.5 / (1e-3 + 2e-3), 1e-6);
  EXPECT_NEAR(at(500'000), 0.8 * 2.5 / (0.25e-3 + 2e-3), 1e-6);
  model.rate_Hz = 1000;  // a faster tick does not make the device's exchange faster
  EXPECT_NEAR(at(250'000), at(1'000'000), 1e-9);
}

TEST(CouplingRuleTest, AnAxisThatTheHandDoesNotFeelBoundsNothingAndIsCalm) {
  DeviceModel model = plain(2, 3e-3);  // no torque
  const double mass_kg = 0.05, inertia = 1e-5;
  const tool::MassProperties body{mass_kg, inertia * Eigen::Matrix3d::Identity()};
  const tool::CouplingGains gains = master_station::coupling_for(capabilities_of(model), {}, body, kTick_ns);
  EXPECT_GT(gains.rotational_stiffness_Nm_per_rad, 1);
  EXPECT_DOUBLE_EQ(gains.rotational_damping_Nms_per_rad,
                   2 * std::sqrt(gains.rotational_stiffness_Nm_per_rad * inertia));
  model.force_dof = 0;
  EXPECT_GT(master_station::coupling_for(capabilities_of(model), {}, body, kTick_ns).stiffness_N_per_m, 1000)
      << "a tool follows a device without force, too";
}

}  // namespace
}  // namespace farfeel::devices
