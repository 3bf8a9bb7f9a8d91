// Devices for tests of the hand: one that a test moves itself, and one with mechanics and a person who holds it.
#pragma once

#include <vector>

#include "master_station/devices/hand/hand.h"
#include "master_station/devices/simulated_device.h"

namespace farfeel::devices {

/// Of the order of a Falcon: a tenth of a metre, three degrees of freedom, buttons 0 to 3.
inline DeviceModel model_of_three() {
  DeviceModel model;
  model.name = "three";
  model.title = "Device of three";
  model.position_dof = model.force_dof = 3;
  model.workspace_min_B_m = {-0.05, -0.04, -0.03};
  model.workspace_max_B_m = {0.05, 0.06, 0.05};
  model.max_force_N = 9;
  model.enabling = Enabling::kHold;
  model.enable_button = 0;
  model.clutch_button = 1;
  model.default_workspace_scale = 2;
  return model;
}

/// The same mechanics as the simulated device's, so that a guard and the coupling's rule have figures to go by.
inline DeviceModel simulated_model_of_three() {
  DeviceModel model = *find_model("simulated");
  model.rotation_dof = model.torque_dof = 0;
  model.enabling = Enabling::kHold;
  model.enable_button = 0;
  model.clutch_button = 1;
  return model;
}

/// Six deflections, told only when they change.
inline DeviceModel model_of_rate() {
  DeviceModel model;
  model.name = "puck";
  model.title = "Puck";
  model.tells = Tells::kRate;
  model.reports = Reports::kEvents;
  model.position_dof = model.rotation_dof = 3;
  model.full_speed_m_s = 0.1;
  model.full_rotation_rad_s = 1;
  model.clutch_button = 1;
  return model;
}

/// Tells what the test says.
class TestSource final : public SampleSource {
 public:
  explicit TestSource(const DeviceModel& model) : data(model) {
    sample.stage = Stage::kReady;
    sample.opening = 1;
  }
  const Sample& newest(std::int64_t now_ns) noexcept override {
    if (is_there) {
      sample.polled_ns = now_ns;
      if (data.reports == Reports::kStream) sample.time_ns = now_ns;
    }
    return sample;
  }
  void command(const Command& c) noexcept override { last = c; }
  const DeviceModel& model() const noexcept override { return data; }

  DeviceModel data;
  Sample sample;
  Command last;
  bool is_there = true;
};

/// The simulated device as one of three degrees of freedom: nobody measures how its handle is turned, and it renders no
/// torque. While it is unplugged nothing holds the handle but the person.
class HeldSource final : public SampleSource {
 public:
  explicit HeldSource(const master_station::SimulatedDeviceSettings& settings, const DeviceModel& model)
      : data(model), device(settings) {
    sample.stage = Stage::kReady;
    sample.opening = 1;
  }
  const Sample& newest(std::int64_t now_ns) noexcept override {
    if (last.opening != sample.opening || !last.is_force_on || !is_there) device.write({});
    const master_station::DeviceState state = device.read(now_ns);
    if (!is_there) return sample;
    sample.time_ns = sample.polled_ns = now_ns;
    sample.X_BD.p = state.X_BD.p;
    sample.V_BD_B.linear_m_s = state.V_BD_B.linear_m_s;
    if (data.rotation_dof == 3) {
      sample.X_BD.R = state.X_BD.R;
      sample.V_BD_B.angular_rad_s = state.V_BD_B.angular_rad_s;
    }
    return sample;
  }
  void command(const Command& c) noexcept override {
    last = c;
    if (is_there && c.is_force_on) device.write({{}, c.F_hand_B.force_N});
  }
  const DeviceModel& model() const noexcept override { return data; }
  void unplug() {
    is_there = false;
    sample.stage = Stage::kAbsent;
  }
  void plug_in() {
    is_there = true;
    sample.stage = Stage::kReady;
    ++sample.opening;
  }

  DeviceModel data;
  Sample sample;
  Command last;
  master_station::SimulatedDevice device;
  bool is_there = true;
};

}  // namespace farfeel::devices
