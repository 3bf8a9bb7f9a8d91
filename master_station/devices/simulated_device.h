// A six-degree-of-freedom device and the hand that holds it, simulated: the complete force path where there is no
// hardware.
//
// A rigid handle with friction, encoders that count in steps, and actuators that hold a wrench from one write to the
// next; a hand that follows an explorer's intent through its grip. Integrated in steps of 20 us (50 kHz), where it also
// counts the energy that the hand puts in: the loop under test has no say in that figure.
#pragma once

#include <cstdint>

#include "haptic_core/passivity/port_observer.h"
#include "master_station/devices/device.h"
#include "master_station/devices/explorer.h"
#include "master_station/devices/grip.h"

namespace farfeel::master_station {

/// Of the order of published desktop devices with six actuated degrees of freedom.
struct SimulatedDeviceSettings {
  double mass_kg = 0.15;
  double inertia_kg_m2 = 2e-4;  ///< the same about every axis
  double coulomb_friction_N = 0.1, viscous_friction_Ns_per_m = 2;
  double coulomb_friction_Nm = 0.003, viscous_friction_Nms_per_rad = 0.006;
  double encoder_step_m = 20e-6, encoder_step_rad = 1e-4;
  double velocity_filter_Hz = 200;  ///< first order, on differences of encoder readings
  double max_force_N = 12, max_torque_Nm = 0.6;
  Grip grip = kMediumGrip;
  ExplorerSettings explorer;  ///< hand_stiffness_N_per_m is taken from the grip
  /// Metres of the tool for a metre of the handle: the hand knows it, and moves so that the tool goes where it wants.
  double workspace_scale = 1;
};

class SimulatedDevice final : public Device {
 public:
  static constexpr std::int64_t kSubstep_ns = 20'000;

  explicit SimulatedDevice(const SimulatedDeviceSettings&);

  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  /// Simulates up to time_ns, at most 100 ms at once; the first call starts the clock.
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override;
  void write(const spatial::Wrench& F_hand_B) noexcept override;
  [[nodiscard]] double hand_energy_J() const noexcept override { return hand_port_.energy_J(); }

  /// Energy into the device from the hand, and from the actuators back into the loop.
  [[nodiscard]] const passivity::PortObserver& hand_port() const noexcept { return hand_port_; }
  [[nodiscard]] const passivity::PortObserver& actuator_port() const noexcept { return actuator_port_; }
  [[nodiscard]] const spatial::Wrench& force_on_hand() const noexcept { return F_actuators_B_; }  ///< about D's origin
  [[nodiscard]] const Explorer& explorer() const noexcept { return explorer_; }
  [[nodiscard]] const spatial::Pose& true_pose() const noexcept { return X_BD_; }  ///< what encoders only approximate
  /// The hand stops following the explorer and holds this intent.
  void hold_at(const spatial::Pose& X_BHand) noexcept;
  /// Presses or releases the clutch button. The explorer does not know of it: for a hand that is told where to hold.
  void hold_clutch(bool is_held) noexcept { is_clutch_held_ = is_held; }

 private:
  void substep() noexcept;
  [[nodiscard]] spatial::Pose intended_pose() const noexcept;
  [[nodiscard]] spatial::Pose encoder_reading() const noexcept;

  SimulatedDeviceSettings settings_;
  DeviceCapabilities capabilities_;
  Explorer explorer_;
  spatial::Pose X_BHand_;  // the hand's intent
  spatial::Twist V_BHand_B_;
  bool is_holding_ = false, is_clutch_held_ = false;
  spatial::Pose X_BD_;
  spatial::Twist V_BD_B_;
  spatial::Wrench F_actuators_B_;
  passivity::PortObserver hand_port_, actuator_port_;
  std::int64_t time_ns_ = 0;
  std::int64_t next_intent_ns_ = 0;
  bool has_started_ = false;
  spatial::Pose last_reading_;
  spatial::Twist velocity_estimate_;
  std::int64_t last_reading_ns_ = 0;
};

}  // namespace farfeel::master_station
