// A hand of three degrees of freedom, the haptic loop, and a wall at z = 0 that answers 500 times a second.
#pragma once

#include <gtest/gtest.h>

#include "master_station/devices/guard/guarded_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/support/analytic_remote.h"
#include "tests/unit/master_station/devices/hand/sources.h"

namespace farfeel::devices {

inline constexpr std::int64_t kTick_ns = 1'000'000;

struct WallRig {
  explicit WallRig(OrientationFrom orientation = OrientationFrom::kFixed, SampleSource* second = nullptr,
                   SampleSource* view = nullptr, const DeviceModel& model = model_of_three(),
                   const spatial::Pose& X_start = {{1, 0, 0, 0}, {0, 0, 0.01}}, bool has_guard = false)
      : source(held(), model),
        device(source, limits_of(source)),
        guard(device, {.model = model}),
        hand(device, has_guard ? static_cast<master_station::Device&>(guard) : device, second, view,
             settings_of(source, orientation, X_start)),
        loop(hand, remote, loop_settings()) {
    remote.answer_period_ns = 2'000'000;
    remote.world.points_T = {
        {0.03, 0.01, -0.003}, {0.03, -0.01, -0.003}, {-0.03, 0.01, -0.003}, {-0.03, -0.01, -0.003}};
    X_held = source.device.true_pose();
  }
  static master_station::SimulatedDeviceSettings held() {
    master_station::SimulatedDeviceSettings settings;
    settings.explorer.hints.region_low_W = {-0.01, -0.01, 0};
    settings.explorer.hints.region_high_W = {0.01, 0.01, 0};
    return settings;
  }
  static master_station::DeviceCapabilities limits_of(const HeldSource& source) {
    master_station::DeviceCapabilities limits = source.device.capabilities();
    limits.torque_dof = 0;
    return limits;
  }
  static HandSettings settings_of(const HeldSource& source, OrientationFrom orientation, const spatial::Pose& X_start) {
    HandSettings settings;
    settings.orientation = orientation;
    settings.twist_button = default_twist_button(source.data);
    settings.X_BD_start = X_start;
    return settings;
  }
  static master_station::HapticLoopSettings loop_settings() {
    master_station::HapticLoopSettings settings;
    settings.timing.period_ns = kTick_ns;
    settings.body = {0.05, Eigen::Vector3d(3e-5, 3e-5, 3e-5).asDiagonal()};
    settings.local_model.rung = local_model::Rung::kLinear;
    return settings;
  }
  /// The person moves what they hold by `by` a tick, for so many ticks; force may change by 0.2 N a tick at most,
  /// unless something is expected to have broken.
  void run(int ticks, const glm::dvec3& by = {0, 0, 0}) {
    for (int i = 0; i < ticks; ++i) {
      X_held.p += by;
      source.device.hold_at(X_held);
      loop.tick({time_ns, 0, 0, 0});
      time_ns += kTick_ns;
      master_station::TickRecord record;
      ASSERT_TRUE(loop.records().pop(record));
      const glm::dvec3 felt = source.device.force_on_hand().force_N;
      ASSERT_LE(glm::length(felt - felt_N), most_step_N) << "tick " << i << " of " << ticks;
      felt_N = felt;
      last = record;
    }
  }

  HeldSource source;
  test_support::AnalyticRemote remote;
  SourceDevice device;
  GuardedDevice guard;
  Hand hand;
  master_station::HapticLoop loop;
  spatial::Pose X_held;
  glm::dvec3 felt_N{0};
  master_station::TickRecord last;
  double most_step_N = 0.2;
  std::int64_t time_ns = 5'000'000'000;
};

}  // namespace farfeel::devices
