// WoodenHaptics: an open-hardware arm of three bodies driven through capstans, and the firmware of its mbed. Written
// from the public tables, with kinematics of its own: bodies that are turned one after the other, and whose Jacobian is
// taken by differences, so that forces come from virtual work.
//
//   to the device    id 0, then seven int16, little-endian: mA of motors a, b, c; command; three attributes
//                    command 0: currents; command 1: the six encoders are set to attributes 0 to 2 and the currents'
//                    slots
//   from the device  seven int16: encoders a to f; 1 once its button was pressed, until encoders are set
//
// It answers a packet with a packet and never speaks first. Half a second without a packet turns the motors off.
// Encoders count from the pose in which it was plugged in.
//
// Frame B: x to the right, y away from the person, z up. The arm points to the person, that is to -y.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "tests/support/devices/hid_emulator.h"

namespace farfeel::test_support {

class WoodenHapticsEmulator final : public HidEmulator {
 public:
  WoodenHapticsEmulator();

  // The hand.
  void grasp(const Eigen::Vector3d& p_B_m, double stiffness_N_per_m = 800);  ///< pulls the handle there from now on
  void let_go() { hand_stiffness_N_per_m_ = 0; }
  void push(const Eigen::Vector3d& F_B_N) { push_B_N_ = F_B_N; }  ///< from now on
  void put_at(const Eigen::Vector3d& angles_rad);                 ///< at once, at rest
  void press_button() { is_button_pressed_ = true; }

  // What happens in truth.
  [[nodiscard]] Eigen::Vector3d handle_B_m() const { return handle_B_m(angles_rad_); }
  [[nodiscard]] Eigen::Vector3d velocity_B_m_s() const { return jacobian_B(angles_rad_) * speeds_rad_s_; }
  [[nodiscard]] Eigen::Vector3d angles_rad() const { return angles_rad_; }
  /// What the motors do to the hand: the force whose virtual work is theirs. Not in a singular pose.
  [[nodiscard]] Eigen::Vector3d motor_force_B_N() const;
  [[nodiscard]] const std::array<std::int16_t, 3>& currents_mA() const { return currents_mA_; }
  [[nodiscard]] bool are_motors_on() const { return are_motors_on_; }
  [[nodiscard]] int watchdog_trips() const { return watchdog_trips_; }  ///< of the device itself
  [[nodiscard]] int refused() const { return refused_; }                ///< packets of another size or command
  /// Lives on until then, for mechanics between packets.
  void advance_to(std::int64_t time_ns);

  [[nodiscard]] HidIdentity identity() const override { return {0x1234, 0x0006, "WoodenHaptics", "WH0001"}; }
  [[nodiscard]] std::span<const std::byte> report_descriptor() const override { return descriptor_; }
  void take_output(std::span<const std::byte> report, std::int64_t time_ns) override;
  std::size_t give_input(std::span<std::byte> to, std::int64_t time_ns) override;

 private:
  [[nodiscard]] static Eigen::Vector3d handle_B_m(const Eigen::Vector3d& angles_rad);
  [[nodiscard]] static Eigen::Matrix3d jacobian_B(const Eigen::Vector3d& angles_rad);
  [[nodiscard]] Eigen::Vector3d motor_torques_Nm() const;  // at the bodies
  [[nodiscard]] std::int16_t counter(int i) const;
  void move(double dt_s);

  std::vector<std::byte> descriptor_;
  Eigen::Vector3d angles_rad_, speeds_rad_s_{0, 0, 0};
  Eigen::Vector3d hand_B_m_{0, 0, 0}, push_B_N_{0, 0, 0};
  double hand_stiffness_N_per_m_ = 0;
  std::array<std::int16_t, 3> currents_mA_{};
  std::array<std::int64_t, 6> counter_offset_{};
  bool are_motors_on_ = false, is_button_pressed_ = false;
  int watchdog_trips_ = 0, refused_ = 0;
  std::int64_t time_ns_ = 0, last_packet_ns_ = 0, answer_ns_ = 0;
  bool is_answer_due_ = false;
};

}  // namespace farfeel::test_support
