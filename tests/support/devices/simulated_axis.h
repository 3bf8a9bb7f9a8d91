// One axis of a device in software: a mass with viscous and dry friction and a limp hand on it, read through an encoder
// and a delay, pushed through a delay. Its own ledger says what force truly gave to the handle.
#pragma once

#include <array>
#include <cstddef>

namespace farfeel::test_support {

class SimulatedAxis {
 public:
  struct Figures {
    double mass_kg = 0.1;
    double viscous_Ns_per_m = 2;  ///< of the device
    double coulomb_N = 0;
    double hand_Ns_per_m = 0.5;  ///< of a limp hand
    double hand_N = 0;           ///< with which it leans on the handle
    double step_m = 0;           ///< of the encoder; 0: none
    int sensor_ticks = 0, actuator_ticks = 0;
    double filter_Hz = 200;  ///< of the velocity that the driver tells
  };
  explicit SimulatedAxis(const Figures& figures, double position_m = 0) : figures_(figures), position_m_(position_m) {
    seen_m_.fill(encoded_m());
    told_m_ = before_m_ = encoded_m();
  }

  /// What the driver tells at this tick.
  [[nodiscard]] double told_m() const { return told_m_; }
  [[nodiscard]] double told_m_s() const { return told_m_s_; }
  /// The force is commanded, and a tick of 1 ms goes by.
  void push(double force_N);

  [[nodiscard]] double position_m() const { return position_m_; }
  [[nodiscard]] double given_J() const { return given_J_; }  ///< by force to handle and hand, since forgotten
  [[nodiscard]] double most_given_J() const { return most_given_J_; }
  [[nodiscard]] double most_in_a_tick_J() const { return most_in_a_tick_J_; }
  void forget_given() { given_J_ = most_given_J_ = most_in_a_tick_J_ = 0; }

 private:
  [[nodiscard]] double encoded_m() const;

  static constexpr std::size_t kTicks = 64;
  Figures figures_;
  double position_m_, velocity_m_s_ = 0;
  std::array<double, kTicks> seen_m_{}, commanded_N_{};
  std::size_t tick_ = 0;
  double told_m_, before_m_, told_m_s_ = 0;
  double given_J_ = 0, most_given_J_ = 0, most_in_a_tick_J_ = 0;
};

/// The stiffest spring with that damping about a fixed point that is calm on it, by trying: without dry friction and
/// encoder, which would hide it, a displaced handle swings less and less. N/m.
[[nodiscard]] double stiffest_calm_N_per_m(SimulatedAxis::Figures figures, double damping_Ns_per_m);

}  // namespace farfeel::test_support
