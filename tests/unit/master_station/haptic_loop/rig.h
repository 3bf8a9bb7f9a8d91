// A device, a hand, a loop and an analytic remote, closed in simulated time: a file-like tool whose four corners touch.
#pragma once

#include <gtest/gtest.h>

#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/support/analytic_remote.h"

namespace farfeel::master_station {

constexpr std::int64_t kTick_ns = 1'000'000;

/// A file-like tool over the surface: four corners touch.
struct Rig {
  explicit Rig(const Grip& grip, double round_trip_s = 0, double answers_hz = 500,
               local_model::Rung rung = local_model::Rung::kLinear, const GearScales& scales = {},
               tool::Integrator integrator = tool::Integrator::kBackwardEuler,
               local_model::ContactLaw contact = local_model::ContactLaw::kPenalty)
      : grip_stiffness_N_per_m(grip.stiffness_N_per_m),
        device(device_settings(grip, scales)),
        loop_scales(scales),
        loop(device, remote, loop_settings(rung, scales, integrator, contact)) {
    remote.set_link({.round_trip_ns = static_cast<std::int64_t>(round_trip_s * 1e9)});
    remote.answer_period_ns = static_cast<std::int64_t>(1e9 / answers_hz);
    remote.world.points_T = {
        {0.09, 0.011, -0.003}, {0.09, -0.011, -0.003}, {-0.09, 0.011, -0.003}, {-0.09, -0.011, -0.003}};
  }
  static SimulatedDeviceSettings device_settings(const Grip& grip, const GearScales& scales = {}) {
    SimulatedDeviceSettings settings;
    settings.grip = grip;
    settings.workspace_scale = scales.workspace;
    settings.explorer.hints = {.p_TWork_T = {0, 0, -0.003},
                               .nhat_work_T = {0, 0, -1},
                               .region_low_W = {-0.04, -0.03, -0.002},
                               .region_high_W = {0.04, 0.03, 0.002},
                               .approach_W = {0, 0, -1},
                               .press_force_N = 3,
                               .stroke_speed_m_per_s = 0.1};
    return settings;
  }
  static HapticLoopSettings loop_settings(local_model::Rung rung = local_model::Rung::kLinear,
                                          const GearScales& scales = {},
                                          tool::Integrator integrator = tool::Integrator::kBackwardEuler,
                                          local_model::ContactLaw contact = local_model::ContactLaw::kPenalty) {
    HapticLoopSettings settings;
    settings.integrator = integrator;
    settings.timing.period_ns = kTick_ns;
    settings.body = {0.05, Eigen::Vector3d(3e-6, 1.7e-4, 1.7e-4).asDiagonal()};
    settings.local_model.rung = rung;
    settings.local_model.contact = contact;
    settings.scales = scales;
    return settings;
  }
  /// Lets the hand stop exploring and press straight down with about press_N.
  void hold(double press_N) {
    spatial::Pose X_WHand = device.explorer().X_WHand();
    const double scale = loop_scales.workspace;
    X_WHand.p = glm::dvec3(X_WHand.p.x, X_WHand.p.y, 0.003) / scale;
    X_WHand.p.z -= press_N / grip_stiffness_N_per_m;
    device.hold_at(X_WHand);
  }
  TickRecord tick() {
    loop.tick({time_ns, 0, 0, 0});
    time_ns += kTick_ns;
    TickRecord record;
    EXPECT_TRUE(loop.records().pop(record));
    return record;
  }

  double grip_stiffness_N_per_m;
  SimulatedDevice device;
  test_support::AnalyticRemote remote;
  GearScales loop_scales;
  HapticLoop loop;
  std::int64_t time_ns = 5'000'000'000;
};

}  // namespace farfeel::master_station
