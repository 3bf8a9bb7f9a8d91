// A new device whose motors do not push where they are told is found at its first grip, in hands that let it run and
// hands that hold it; the same hands with a sound device, for long, on soft and stiff surfaces, are never told off.
// What many hands make of it: farfeel-bench watches.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "master_station/devices/guard/guarded_device.h"
#include "tests/support/guarded_rig.h"

namespace farfeel::devices {
namespace {

using master_station::Fault;
using master_station::Grip;

constexpr Grip kLimpGrip{"limp", 20, 0.5, 0.05, 0.001, 0};
constexpr double kFelt_N = 0.3;

struct Outcome {
  int touched = -1, ended = -1;  // ticks
  Fault fault = Fault::kNone;
  double least_J = 0, most_N = 0;
};

Outcome run(GuardedRig& rig, int ticks) {
  Outcome outcome;
  for (int i = 0; i < ticks; ++i) {
    const double force_N = glm::length(rig.tick().F_hand_W.force_N);
    outcome.most_N = std::max(outcome.most_N, force_N);
    if (outcome.touched < 0 && force_N >= kFelt_N) outcome.touched = i;
    outcome.fault = rig.loop.fault();
    if (outcome.fault != Fault::kNone) {
      outcome.ended = i;
      break;
    }
  }
  outcome.least_J = rig.guard.work().least_J();
  return outcome;
}

TEST(AxisOrSignTest, AWrongSignAndSwappedAxesOfANewDeviceAreToldBeforeTheFirstTouch) {
  const std::array wirings{glm::dmat3(-1), glm::dmat3(1, 0, 0, 0, 1, 0, 0, 0, -1),
                           glm::dmat3(0, 0, 1, 0, 1, 0, 1, 0, 0), glm::dmat3(0, 1, 0, 0, 0, 1, 1, 0, 0),
                           glm::dmat3(0, 0, 1, 1, 0, 0, 0, 1, 0)};
  for (std::size_t wiring = 0; wiring < wirings.size(); ++wiring) {
    for (const Grip& grip : {kLimpGrip, master_station::kSoftGrip, master_station::kMediumGrip}) {
      for (const double surface_N_per_m : {1000.0, 20000.0}) {
        GuardSettings settings;
        settings.is_new_device = true;
        GuardedRig rig(grip, *find_model("simulated"), surface_N_per_m, settings);
        rig.wires.axes = wirings[wiring];
        const Outcome outcome = run(rig, 4000);
        EXPECT_EQ(outcome.fault, Fault::kDeviceGoesElsewhere) << "wiring " << wiring << " " << grip.name;
        EXPECT_GT(outcome.ended, 0) << "wiring " << wiring << " " << grip.name;
        EXPECT_NE(rig.guard.stage(), Stage::kEnabled) << "nothing was felt with it";
        for (int i = 0; i < 25; ++i) rig.tick();
        EXPECT_EQ(glm::length(rig.wires.written.force_N), 0);
      }
    }
  }
}

TEST(AxisOrSignTest, ASoundDeviceIsNeverTold) {
  for (const std::string model : {"simulated", "simulated-late", "simulated-slow"}) {
    for (const Grip& grip :
         {kLimpGrip, master_station::kSoftGrip, master_station::kMediumGrip, master_station::kHardGrip}) {
      for (const double surface_N_per_m : {50.0, 300.0, 1000.0, 20000.0}) {
        GuardSettings settings;
        settings.is_new_device = surface_N_per_m == 1000;
        GuardedRig rig(grip, *find_model(model), surface_N_per_m, settings);
        const Outcome outcome = run(rig, 4000);
        EXPECT_EQ(outcome.fault, Fault::kNone) << model << " " << grip.name << " " << surface_N_per_m;
        EXPECT_GE(outcome.least_J, -0.6 * WorkWatch::kAllowance_J) << "with a margin";
      }
    }
  }
}

TEST(AxisOrSignTest, InAHandThatHoldsStillAxesAreKnownInSeconds) {
  for (const std::string& name : model_names()) {
    const DeviceModel& model = *find_model(name);
    if (model.force_dof == 0) continue;
    for (const Grip& grip : {kLimpGrip, master_station::kSoftGrip, master_station::kMediumGrip}) {
      for (const bool is_wrong : {false, true}) {
        master_station::SimulatedDevice device(GuardedRig::device_settings(model, grip));
        device.start_at({});
        Miswired wires(device);
        if (is_wrong) wires.axes[0][0] = -1;
        AxisProbe probe(model, 0.5 * model.max_force_N);
        int ticks = 0;
        for (; probe.verdict() == AxisProbe::Verdict::kOpen && ticks < 20'000; ++ticks) {
          const master_station::DeviceState state = wires.read(ticks * GuardedRig::kTick_ns);
          wires.write({{0, 0, 0}, probe.next(state.X_BD.p, state.V_BD_B.linear_m_s, 1e-3)});
        }
        EXPECT_EQ(probe.verdict(), is_wrong ? AxisProbe::Verdict::kWrong : AxisProbe::Verdict::kRight)
            << name << " " << grip.name;
        EXPECT_LE(ticks, model.rate_Hz < 500 && model.rate_Hz > 0 ? 5000 : 2500) << name << " " << grip.name;
      }
    }
  }
}

TEST(AxisOrSignTest, OfAHandleThatNothingMovesNothingIsTold) {
  AxisProbe probe(*find_model("simulated"), 8);
  for (int i = 0; i < 3000; ++i) (void)probe.next({0.1, 0, 0}, {0, 0, 0}, 1e-3);
  EXPECT_EQ(probe.verdict(), AxisProbe::Verdict::kNotTold);
}

/// The master's own mapping has a wrong sign: the device does what it is told, and is told to drive the hand on.
void drive_on(bool is_new_device) {
  GuardSettings settings;
  settings.model = *find_model("simulated");
  settings.is_new_device = is_new_device;
  master_station::SimulatedDevice device(GuardedRig::device_settings(settings.model, master_station::kSoftGrip));
  device.hold_at({});
  GuardedDevice guard(device, settings);
  constexpr std::int64_t kTick_ns = 1'000'000;
  int given = 0, ended = -1;
  for (int i = 0; i < 6000 && ended < 0; ++i) {
    const master_station::DeviceState state = guard.read(i * kTick_ns);
    if (state.fault == master_station::DeviceFault::kGivesWork) ended = i;
    if (i == 3000) device.hold_at({{1, 0, 0, 0}, {0, 0, -0.002}});
    const double away_m = state.X_BD.p.z;
    if (i < 3000) {
      guard.write({});
      continue;
    }
    if (given == 0 && std::abs(away_m) > 0.5e-3) given = i;
    guard.write({{0, 0, 0}, {0, 0, 800 * away_m}});
  }
  ASSERT_GT(ended, 0);
  EXPECT_LE(ended - given, is_new_device ? 2500 : 250) << "a new one pushes with a fifth of the force";
  for (int i = ended + 1; i < ended + 200; ++i) {
    (void)guard.read(i * kTick_ns);
    guard.write({{0, 0, 0}, {0, 0, 5}});
  }
  EXPECT_EQ(glm::length(device.force_on_hand().force_N), 0) << "without a new grip";
  EXPECT_EQ(guard.stage(), is_new_device ? Stage::kFault : Stage::kReady);
}

TEST(AxisOrSignTest, AForceThatGoesOnGivingEndsTheGrip) {
  drive_on(false);
}

TEST(AxisOrSignTest, OfADeviceThatIsNewItIsAFault) {
  drive_on(true);
}

TEST(AxisOrSignTest, WhatMovingObjectsDoToTheHandIsNoFault) {
  WorkWatch told, untold;
  bool told_trips = false, untold_trips = false;
  spatial::Pose X;
  for (int i = 0; i < 1000; ++i) {  // pushed up by 3 N, 100 mm
    const spatial::Pose next{X.R, X.p + glm::dvec3(0, 0, 1e-4)};
    told_trips |= told.next({{0, 0, 0}, {0, 0, 3}}, X, next, 3e-4, 1e-3);
    untold_trips |= untold.next({{0, 0, 0}, {0, 0, 3}}, X, next, 0, 1e-3);
    X = next;
  }
  EXPECT_FALSE(told_trips);
  EXPECT_TRUE(untold_trips);
}

TEST(AxisOrSignTest, ASoftSpringMayGiveBackAllThatItTook) {
  WorkWatch watch;
  bool trips = false;
  spatial::Pose X;
  for (int cycle = 0; cycle < 5; ++cycle) {
    for (int i = 0; i < 2000; ++i) {  // 60 mm into 100 N/m and out again: 180 mJ, for a second
      const double depth_m = 0.03 * (1 - std::cos(std::numbers::pi * (i + 1) / 1000));
      const spatial::Pose next{X.R, {0, 0, -depth_m}};
      trips |= watch.next({{0, 0, 0}, {0, 0, -100 * 0.5 * (X.p.z + next.p.z)}}, X, next, 0, 1e-3);
      X = next;
    }
  }
  EXPECT_FALSE(trips);
}

}  // namespace
}  // namespace farfeel::devices
