// A device whose motors do not push where they are told, in hands that let it run and hands that hold it; and the same
// hands with a sound device, for long, on soft and stiff surfaces: those are never told off.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/master_station/devices/guard/guarded_rig.h"

namespace farfeel::devices {
namespace {

using master_station::Fault;
using master_station::Grip;

constexpr Grip kLimpGrip{"limp", 20, 0.5, 0.05, 0.001, 0};
constexpr double kFelt_N = 0.3;

struct Outcome {
  int touched = -1, ended = -1;  // ticks
  Fault fault = Fault::kNone;
  double most_share = 0, least_J = 0, most_N = 0;
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
  outcome.most_share = rig.guard.touch().worst_share();
  outcome.least_J = rig.guard.work().least_J();
  return outcome;
}

TEST(AxisOrSignTest, AWrongSignAndSwappedAxesAreToldSoonAfterTheFirstTouch) {
  const std::array wirings{glm::dmat3(-1), glm::dmat3(1, 0, 0, 0, 1, 0, 0, 0, -1),
                           glm::dmat3(0, 0, 1, 0, 1, 0, 1, 0, 0), glm::dmat3(0, 1, 0, 0, 0, 1, 1, 0, 0),
                           glm::dmat3(0, 0, 1, 1, 0, 0, 0, 1, 0)};
  for (std::size_t wiring = 0; wiring < wirings.size(); ++wiring) {
    for (const Grip& grip : {kLimpGrip, master_station::kSoftGrip, master_station::kMediumGrip}) {
      for (const double surface_N_per_m : {1000.0, 20000.0}) {
        GuardedRig rig(grip, *find_model("simulated"), surface_N_per_m);
        rig.wires.axes = wirings[wiring];
        const Outcome outcome = run(rig, 2000);
        EXPECT_EQ(outcome.fault, Fault::kDeviceGoesElsewhere) << "wiring " << wiring << " " << grip.name;
        EXPECT_LE(outcome.ended - outcome.touched, 100) << "wiring " << wiring << " " << grip.name;
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
        GuardedRig rig(grip, *find_model(model), surface_N_per_m);
        const Outcome outcome = run(rig, 4000);
        EXPECT_EQ(outcome.fault, Fault::kNone) << model << " " << grip.name << " " << surface_N_per_m;
        EXPECT_LE(outcome.most_share, 0.6 * TouchWatch::kShare) << "with a margin";
        EXPECT_GE(outcome.least_J, -0.6 * WorkWatch::kAllowance_J) << "with a margin";
      }
    }
  }
}

/// The master's own mapping has a wrong sign: the device does what it is told, and is told to drive the hand on.
TEST(AxisOrSignTest, AForceThatGoesOnGivingIsAFault) {
  GuardSettings settings;
  settings.model = *find_model("simulated");
  master_station::SimulatedDevice device(GuardedRig::device_settings(settings.model, master_station::kSoftGrip));
  device.hold_at({});
  GuardedDevice guard(device, settings);
  int given = 0, ended = -1;
  for (int i = 0; i < 3000 && ended < 0; ++i) {
    const master_station::DeviceState state = guard.read(i * 1'000'000);
    if (i == 500) device.hold_at({{1, 0, 0, 0}, {0, 0, -0.002}});
    const double away_m = state.X_BD.p.z;
    if (given == 0 && std::abs(away_m) > 0.5e-3) given = i;
    guard.write({{0, 0, 0}, {0, 0, 800 * away_m}});
    if (guard.fault() == master_station::DeviceFault::kGivesWork) ended = i;
  }
  EXPECT_GT(ended, 0);
  EXPECT_LE(ended - given, 250);
}

TEST(AxisOrSignTest, WhatMovingObjectsDoToTheHandIsNoFault) {
  WorkWatch told, untold;
  bool told_trips = false, untold_trips = false;
  spatial::Pose X;
  for (int i = 0; i < 500; ++i) {  // pushed up by 3 N, 50 mm
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
