// A device of any model and the hand that holds it, simulated: the complete force path where there is no hardware.
//
// A rigid handle with friction, encoders that count in steps, an exchange that takes place when it does, readings and
// forces that come late, and actuators that hold a wrench from one command to the next; a hand that follows an
// explorer's intent through its grip. Integrated in steps of 20 us (50 kHz), where it also counts the energy that the
// hand puts in: the loop under test has no say in that figure.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/passivity/port_observer.h"
#include "master_station/devices/device.h"
#include "master_station/devices/explorer.h"
#include "master_station/devices/grip.h"
#include "master_station/devices/model/coupling_rule.h"

namespace farfeel::master_station {

struct SimulatedDeviceSettings {
  devices::DeviceModel model = *devices::find_model("simulated");
  devices::Grasp hand = devices::Grasp::kAny;
  double velocity_filter_Hz = 200;  ///< first order, on differences of encoder readings
  Grip grip = kMediumGrip;
  ExplorerSettings explorer;  ///< hand_stiffness_N_per_m is taken from the grip
  /// Metres of the tool for a metre of the handle: the hand knows it, and moves so that the tool goes where it wants.
  double workspace_scale = 1;
  glm::dvec3 p_WB{0};  ///< the device's base in the world, whose axes it has [m of the handle]
};

class SimulatedDevice : public Device {
 public:
  static constexpr std::int64_t kSubstep_ns = 20'000;

  explicit SimulatedDevice(const SimulatedDeviceSettings&);

  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
  /// Simulates up to time_ns, at most 100 ms at once; the first call starts the clock.
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override;
  void write(const spatial::Wrench& F_hand_B) noexcept override;
  /// The hand lets go of the grip's button and grips anew.
  void reset() noexcept override { gripped_from_ns_ = time_ns_ + kGripsAnew_ns; }
  [[nodiscard]] double hand_energy_J() const noexcept override { return hand_port_.energy_J(); }

  /// Energy into the device from the hand, and from the actuators back into the loop.
  [[nodiscard]] const passivity::PortObserver& hand_port() const noexcept { return hand_port_; }
  [[nodiscard]] const passivity::PortObserver& actuator_port() const noexcept { return actuator_port_; }
  [[nodiscard]] const spatial::Wrench& force_on_hand() const noexcept { return F_actuators_B_; }  ///< about D's origin
  [[nodiscard]] const Explorer& explorer() const noexcept { return explorer_; }
  [[nodiscard]] const spatial::Pose& true_pose() const noexcept { return X_BD_; }  ///< what encoders only approximate
  /// Before the first reading: the hand holds the handle here, at rest.
  void start_at(const spatial::Pose& X_BHand) noexcept;
  /// The hand stops following the explorer and holds this intent, which moves on with V.
  void hold_at(const spatial::Pose& X_BHand, const spatial::Twist& V_BHand_B = {}) noexcept;
  /// It holds otherwise from now on, or lets go. Its mass stays on the handle.
  void grip_as(const Grip&) noexcept;
  /// Presses or releases the clutch button. The explorer does not know of it: for a hand that is told where to hold.
  void hold_clutch(bool is_held) noexcept { is_clutch_held_ = is_held; }

  static constexpr std::int64_t kGripsAnew_ns = 50'000'000;  ///< as long as a finger takes

 private:
  void substep() noexcept;
  void take_reading(std::int64_t time_ns) noexcept;
  [[nodiscard]] spatial::Wrench possible(const spatial::Wrench&) const noexcept;
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
  spatial::Wrench F_written_B_, F_sent_B_, F_actuators_B_;  // by the loop, with the last exchange, at the handle
  std::vector<spatial::Pose> poses_late_;                   // encoder readings under way, one a substep; a ring
  std::vector<spatial::Wrench> wrenches_late_;
  std::size_t next_late_pose_ = 0, next_late_wrench_ = 0;
  glm::dquat R_BD_start_{1, 0, 0, 0};
  std::int64_t exchange_ns_ = 0, next_exchange_ns_ = 0, gripped_from_ns_ = 0;
  passivity::PortObserver hand_port_, actuator_port_;
  std::int64_t time_ns_ = 0;
  std::int64_t next_intent_ns_ = 0;
  bool has_started_ = false;
  spatial::Pose last_reading_;
  spatial::Twist velocity_estimate_;
  std::int64_t last_reading_ns_ = 0;
};

}  // namespace farfeel::master_station
