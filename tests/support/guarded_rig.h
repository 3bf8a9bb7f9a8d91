// A guarded simulated device, its hand, a loop and a flat surface, closed in simulated time.
#pragma once

#include <functional>

#include "master_station/devices/guard/guarded_device.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/support/analytic_remote.h"

namespace farfeel::devices {

/// What a wrong driver does to a device: wrenches before they reach it, readings after.
class Miswired final : public master_station::Device {
 public:
  explicit Miswired(master_station::Device& device) : device_(device) {}
  const master_station::DeviceCapabilities& capabilities() const noexcept override { return device_.capabilities(); }
  master_station::DeviceState read(std::int64_t time_ns) noexcept override {
    master_station::DeviceState state = device_.read(time_ns);
    if (on_read) on_read(state);
    return state;
  }
  void write(const spatial::Wrench& F) noexcept override {
    written = F;
    device_.write({F.torque_Nm, axes * F.force_N});
  }
  void reset() noexcept override { device_.reset(); }
  double hand_energy_J() const noexcept override { return device_.hand_energy_J(); }

  glm::dmat3 axes{1};
  std::function<void(master_station::DeviceState&)> on_read;
  spatial::Wrench written;

 private:
  master_station::Device& device_;
};

struct GuardedRig {
  static constexpr std::int64_t kTick_ns = 1'000'000;

  static master_station::SimulatedDeviceSettings device_settings(const DeviceModel& model,
                                                                 const master_station::Grip& grip) {
    master_station::SimulatedDeviceSettings settings;
    settings.model = model;
    settings.grip = grip;
    settings.explorer.hints = {.p_TWork_T = {0, 0, -0.003},
                               .nhat_work_T = {0, 0, -1},
                               .region_low_W = {-0.04, -0.03, -0.002},
                               .region_high_W = {0.04, 0.03, 0.002},
                               .approach_W = {0, 0, -1},
                               .press_force_N = 3,
                               .stroke_speed_m_per_s = 0.1};
    return settings;
  }
  static master_station::HapticLoopSettings loop_settings() {
    master_station::HapticLoopSettings settings;
    settings.timing.period_ns = kTick_ns;
    settings.body = {0.05, Eigen::Vector3d(3e-6, 1.7e-4, 1.7e-4).asDiagonal()};
    return settings;
  }

  explicit GuardedRig(const master_station::Grip& grip = master_station::kMediumGrip,
                      const DeviceModel& model = *find_model("simulated"), double surface_N_per_m = 1000,
                      GuardSettings guard_settings = {}, const glm::dquat& R_WB = {1, 0, 0, 0},
                      const motion::ScriptedMotion* surface = nullptr)
      : device(device_settings(model, grip)),
        wires(device),
        guard(wires,
              [&] {
                guard_settings.model = model;
                return guard_settings;
              }()),
        loop(guard, remote, [&] {
          master_station::HapticLoopSettings settings = loop_settings();
          settings.X_WB.R = R_WB;
          if (surface != nullptr) settings.moving.push_back({0, *surface});
          return settings;
        }()) {
    remote.set_link({.round_trip_ns = 0});
    remote.answer_period_ns = 2'000'000;
    remote.world.material.stiffness_N_per_m = surface_N_per_m / 4;
    remote.world.points_T = {
        {0.09, 0.011, -0.003}, {0.09, -0.011, -0.003}, {-0.09, 0.011, -0.003}, {-0.09, -0.011, -0.003}};
  }
  master_station::TickRecord tick() {
    loop.tick({time_ns, 0, 0, 0});
    time_ns += kTick_ns;
    master_station::TickRecord record;
    (void)loop.records().pop(record);
    return record;
  }

  master_station::SimulatedDevice device;
  Miswired wires;
  GuardedDevice guard;
  test_support::AnalyticRemote remote;
  master_station::HapticLoop loop;
  std::int64_t time_ns = 5'000'000'000;
};

}  // namespace farfeel::devices
